"""UsdGeom Points: spheres, as copies of one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..claim import Claim
from ..context import Context
from ..groups import Copies, Group
from ..registry import converts
from ..report import InputError
from . import primvars
from .looks import look_of
from .mesh import no_motion
from .primvars import Primvar


@converts("Points")
def points(ctx: Context, claim: Claim) -> None:
    """Each point a sphere of its width."""
    no_motion(claim)
    claim.take("ids", "doubleSided", "orientation")
    claim.no_effect("normals", "points are spheres", "their normals are their own")
    look = look_of(ctx, claim)
    centres = claim.array("points", float, 3)
    if centres is None or len(centres) == 0:
        ctx.report.note(claim.path, "points without points")
        claim.take("widths")
        return
    radii = 0.5 * widths(claim, len(centres), 1.0)
    shown = radii > 0
    if not shown.all():
        claim.approximated("widths", "widths of 0 or less", f"{(~shown).sum()} points can't be seen")
    matrices = np.zeros((int(shown.sum()), 4, 4))
    for axis in range(3):
        matrices[:, axis, axis] = radii[shown]
    matrices[:, :3, 3] = centres[shown]
    matrices[:, 3, 3] = 1.0
    ball = Group(f"{claim.path} point")
    ball.add({"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": 1.0, **look.shape}, np.eye(4))
    claim.group.copies.append(Copies(ball, claim.matrix @ matrices))


def widths(claim: Claim, count: int, default: float) -> NDArray[Any]:
    """Widths of so many elements; constant ones are repeated."""
    found = primvars.read(claim, "widths")
    if found is None:
        values = claim.array("widths")
        if values is not None and len(values):
            found = Primvar("widths", values, "constant" if len(values) == 1 else "vertex")
    claim.take("widths")
    if found is None:
        claim.approximated("widths", "there are none", f"a width of {default:g} is used")
        return np.full(count, default)
    if len(found.values) == 1:
        return np.full(count, float(found.values[0]))
    if len(found.values) != count:
        raise InputError(f"{claim.path}.widths", f"has {len(found.values)} elements for {count} points")
    return np.asarray(found.values, dtype=float)
