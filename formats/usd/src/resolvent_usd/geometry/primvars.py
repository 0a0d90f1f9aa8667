"""Primvars: per object, face, vertex or corner, flattened to what a mesh needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ..claim import Claim
from ..report import InputError

Array = NDArray[Any]
Ints = NDArray[np.int64]


@dataclass(frozen=True)
class Primvar:
    """A primvar's values, indices resolved."""

    name: str
    values: Array
    """(n,) or (n, k)"""
    interpolation: str
    """constant, uniform, vertex, varying or faceVarying"""


def read(claim: Claim, name: str) -> Primvar | None:
    """A primvar (without "primvars:") of a prim or inherited from those above; None if it has no value."""
    api = UsdGeom.PrimvarsAPI(claim.prim)
    primvar = api.FindPrimvarWithInheritance(name)
    if not primvar or not primvar.HasValue():
        return None
    attribute = primvar.GetAttr()
    owner = str(attribute.GetPrim().GetPath())
    for used in (attribute.GetName(), f"{attribute.GetName()}:indices"):
        claim.ctx.used.add((owner, used))
        if owner == claim.path:
            claim.take(used)
    value = attribute.Get(claim.ctx.time)
    if value is None:
        return None
    values = np.asarray(value)
    if values.dtype.kind not in "fiub":
        return None
    scalar = not attribute.GetTypeName().isArray
    values = values[None] if scalar else values
    if values.dtype.kind == "f" and not np.isfinite(values).all():
        raise InputError(f"{claim.path}.primvars:{name}", "has numbers that are not finite (NaN or infinity)")
    if primvar.IsIndexed():
        indices = np.asarray(primvar.GetIndices(claim.ctx.time), dtype=np.int64)
        if len(indices) and (indices.min() < 0 or indices.max() >= len(values)):
            raise InputError(
                f"{claim.path}.primvars:{name}:indices", f"names element {indices.max()} of {len(values)}"
            )
        values = values[indices]
    interpolation = str(primvar.GetInterpolation())
    # One value of a primvar that should have many is meant for all: OpenUSD's own imaging reads it so.
    if len(values) == 1:
        interpolation = "constant"
    return Primvar(name, values, interpolation)


@dataclass(frozen=True)
class Topology:
    """How many of each there are, and how corners refer to them."""

    points: int
    counts: Ints
    indices: Ints

    def expected(self, interpolation: str) -> int:
        return {
            "constant": 1, "uniform": len(self.counts), "vertex": self.points, "varying": self.points,
            "faceVarying": len(self.indices),
        }[interpolation]  # fmt: skip


def checked(claim: Claim, primvar: Primvar, topology: Topology) -> Primvar | None:
    """The primvar if it has as many elements as the mesh asks for; else it is reported and has no effect."""
    if primvar.interpolation not in ("constant", "uniform", "vertex", "varying", "faceVarying"):
        claim.skipped(
            f"primvars:{primvar.name}", f"unknown interpolation '{primvar.interpolation}'", "it has no effect"
        )
        return None
    expected = topology.expected(primvar.interpolation)
    if len(primvar.values) < expected or (primvar.interpolation != "constant" and len(primvar.values) != expected):
        claim.skipped(
            f"primvars:{primvar.name}",
            f"has {len(primvar.values)} {primvar.interpolation} elements where the topology asks for {expected}",
            "it has no effect",
        )
        return None
    return primvar


def corners(primvar: Primvar, topology: Topology) -> Array:
    """One value per corner of the polygons."""
    values = primvar.values
    match primvar.interpolation:
        case "constant":
            return np.broadcast_to(values[0], (len(topology.indices), *values.shape[1:]))
        case "uniform":
            return np.repeat(values, topology.counts, axis=0)
        case "faceVarying":
            return values
        case _:
            return values[topology.indices]
