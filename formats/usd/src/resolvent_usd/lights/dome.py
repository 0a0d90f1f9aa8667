"""DomeLight and DomeLight_1: light from all directions, of one colour or by an image."""

from __future__ import annotations

import numpy as np

from ..claim import Claim
from ..context import Context
from ..registry import converts
from ..scene import Json, Matrix, rgb, rows
from .emission import dark, no_shaping, radiance, value

_MAPPINGS = {
    "automatic": "latlong",
    "latlong": "latlong",
    "mirroredBall": "mirrored_ball",
    "angular": "angular",
    "cubeMapVerticalCross": "vertical_cross",
}
_PLAIN_SPACES = ("auto", "lin_rec709", "lin_rec709_scene", "srgb_texture", "srgb_rec709_scene", "sRGB")
_POLE_Z: Matrix = np.array([[1.0, 0, 0, 0], [0, 0, -1, 0], [0, 1, 0, 0], [0, 0, 0, 1]])
"""From images with the pole at +y and longitude 0 at +z to a pole at +z and longitude 0 at −y."""


@converts("DomeLight", "DomeLight_1", per_instance=True)
def dome(ctx: Context, claim: Claim) -> None:
    """An environment; ``normalize`` has no meaning for it."""
    no_shaping(claim)
    color = radiance(claim, 1.0)
    claim.take("guideRadius", "poleAxis")
    if claim.targets("portals"):
        # They guide sampling where they are; the light is the same without them.
        ctx.report.note(claim.path, "portals are of no use to this renderer")
    file = value(claim, "inputs:texture:file")
    layout = str(value(claim, "inputs:texture:format", "automatic"))
    if dark(claim, color):
        return
    if file is None or not file.path:
        ctx.scene.lights.append({"type": "environment", "radiance": rgb(color)})
        return
    if layout not in _MAPPINGS:
        claim.approximated("inputs:texture:format", f"'{layout}' is unknown", "the image is taken for latitude and longitude")
    mapping = _MAPPINGS.get(layout, "latlong")
    light: Json = {"type": "environment", "image": ctx.file(claim, "inputs:texture:file", file), "scale": rgb(color)}
    if mapping != "latlong":
        claim.approximated(
            "inputs:texture:format",
            f"the specification leaves the orientation of '{layout}' open",
            "the image's centre is +z, as with latlong",
        )
        light["mapping"] = mapping
    space = claim.prim.GetAttribute("inputs:texture:file").GetColorSpace()
    if space and space not in _PLAIN_SPACES:
        claim.approximated(
            "inputs:texture:file", f"the colour space '{space}' is not converted", "8 and 16 bits are read as sRGB, the rest as linear"
        )
    turn = rotation(claim)
    if str(claim.prim.GetTypeName()) == "DomeLight_1":
        pole = str(claim.get("poleAxis", "scene"))
        if pole == "Z" or (pole == "scene" and ctx.up_axis == "Z"):
            turn = turn @ _POLE_Z
    if not np.array_equal(turn, np.eye(4)):
        light["transform"] = rows(turn)
    ctx.scene.lights.append(light)


def rotation(claim: Claim) -> Matrix:
    """The rotation (and reflection) nearest to the prim's transform: directions have no place and no scale."""
    u, s, vt = np.linalg.svd(claim.matrix[:3, :3])
    if s[0] > s[2] * (1.0 + 1e-6):
        claim.approximated("xformOp", "the transform stretches the dome", "only its rotation is used")
    out: Matrix = np.eye(4)
    out[:3, :3] = u @ vt
    # Exact ones stay exact.
    nearest = np.round(out)
    return nearest if np.abs(out - nearest).max() < 1e-12 else out
