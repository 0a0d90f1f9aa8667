"""UsdGeom PointInstancer: true copies of its prototypes, nested ones included."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ..claim import Claim
from ..context import Context
from ..groups import Copies
from ..registry import converts
from ..report import InputError
from ..scene import Matrix
from .mesh import no_motion



@converts("PointInstancer")
def instancer(ctx: Context, claim: Claim) -> None:
    """Converts each prototype once and places it by matrices."""
    claim.prune()
    no_motion(claim)
    claim.take("positions", "orientations", "orientationsf", "scales", "protoIndices", "ids", "invisibleIds", "prototypes")
    claim.take("inactiveIds")
    claim.take_schema("MaterialBindingAPI", "CollectionAPI")
    claim.take_prefix("material:binding")
    _varying_primvars(claim)
    schema = UsdGeom.PointInstancer(claim.prim)
    targets = claim.targets("prototypes")
    indices = claim.array("protoIndices", np.int64)
    if indices is None or len(indices) == 0:
        ctx.report.note(claim.path, "an instancer without instances")
        return
    if indices.min() < 0 or indices.max() >= len(targets):
        raise InputError(f"{claim.path}.protoIndices", f"names prototype {indices.max()} of {len(targets)}")
    matrices = _matrices(ctx, claim, schema, len(indices))
    mask = np.asarray(schema.ComputeMaskAtTime(ctx.time), dtype=bool)
    shown = np.ones(len(indices), dtype=bool)
    if len(mask):
        if len(mask) != len(indices):
            raise InputError(f"{claim.path}.ids", f"has {len(mask)} elements for {len(indices)} instances")
        shown &= mask
    flat = _flat(matrices)
    if (flat & shown).any():
        claim.approximated("scales", "scales of 0", f"{int((flat & shown).sum())} instances can't be seen")
        shown &= ~flat
    for number, target in enumerate(targets):
        which = np.flatnonzero((indices == number) & shown)
        if not len(which):
            continue
        prim = ctx.stage.GetPrimAtPath(target)
        if not prim:
            raise InputError(f"{claim.path}.prototypes", f"names '{target}', which the stage does not have")
        group = ctx.walk.prototype(prim, claim.purpose)
        claim.group.copies.append(Copies(group, claim.matrix @ matrices[which]))


def _matrices(ctx: Context, claim: Claim, schema: UsdGeom.PointInstancer, count: int) -> Matrix:
    """Instance to instancer, without the prototypes' own transforms."""
    for name, size in (("positions", True), ("orientations", False), ("orientationsf", False), ("scales", False)):
        value = claim.get(name)
        if value is None or (len(value) == 0 and not size):
            continue
        if len(value) != count:
            raise InputError(f"{claim.path}.{name}", f"has {len(value)} elements for {count} instances")
    found = schema.ComputeInstanceTransformsAtTime(
        ctx.time, ctx.time, UsdGeom.PointInstancer.ExcludeProtoXform, UsdGeom.PointInstancer.IgnoreMask
    )
    matrices = np.array(found, dtype=float).reshape(-1, 4, 4)
    if len(matrices) != count:
        raise InputError(f"{claim.path}.positions", f"has {len(matrices)} elements for {count} instances")
    if not np.isfinite(matrices).all():
        raise InputError(claim.path, "its instances have transforms that are not finite (NaN or infinity)")
    return np.asarray(matrices.transpose(0, 2, 1))


def _flat(matrices: Matrix) -> NDArray[Any]:
    linear = matrices[:, :3, :3]
    size = np.prod(np.linalg.norm(linear, axis=1), axis=1)
    return np.asarray(np.abs(np.linalg.det(linear)) <= 1e-14 * size)


def _varying_primvars(claim: Claim) -> None:
    """Primvars of instancers go to their prototypes; of one value per instance there is no way."""
    for primvar in UsdGeom.PrimvarsAPI(claim.prim).GetPrimvarsWithAuthoredValues():
        name = str(primvar.GetAttr().GetName())
        if primvar.GetInterpolation() != UsdGeom.Tokens.constant:
            claim.skipped(name, "values per instance are not there", "all instances have their prototype's")
        claim.take(name, f"{name}:indices")


