"""DistantLight: a disc of constant radiance at infinity."""

from __future__ import annotations

import numpy as np

from ..claim import Claim
from ..context import Context
from ..registry import converts
from ..scene import rgb
from .emission import dark, no_shaping, radiance, value


@converts("DistantLight", per_instance=True)
def distant(ctx: Context, claim: Claim) -> None:
    """Shines along −z.

    Seen under the half angle θ, the disc of radiance L gives π sin² θ · L on a plane that faces it; with θ = 0 the
    irradiance is L itself. ``normalize`` divides L by that.
    """
    no_shaping(claim)
    angle = float(np.clip(value(claim, "inputs:angle", 0.53), 0.0, 360.0))
    half = np.radians(0.5 * min(angle, 180.0))
    projected = float(np.pi * np.sin(half) ** 2) if angle > 0.0 else 1.0
    wide = np.radians(0.5 * angle)
    size = projected if angle <= 180.0 else float((2.0 - np.sin(wide) ** 2) * np.pi)
    color = radiance(claim, size)
    if dark(claim, color):
        return
    if angle > 180.0:
        claim.approximated("inputs:angle", f"a disc of {angle:g}° is more than half of all directions", "one of 180° is used")
    if size != 1.0 and not bool(value(claim, "inputs:normalize", False)) and projected < 1e-2:
        # What surprises most in these units: intensity is the radiance of a disc that is tiny.
        ctx.report.note(claim.path, f"not normalized: gives an irradiance of {float(color.max() * projected):.3g} at most")
    to_light = claim.matrix[:3, 2] / np.linalg.norm(claim.matrix[:3, 2])
    ctx.scene.lights.append(
        {"type": "distant", "to_light": rgb(to_light), "irradiance": rgb(color * projected), "angle_deg": min(angle, 180.0)}
    )
