"""Materials: which one is bound, and what its shader network becomes."""

from __future__ import annotations

from typing import TYPE_CHECKING

from pxr import Usd, UsdShade

from ..shading import network
from . import glow, surfaces
from .values import Builder

if TYPE_CHECKING:
    from ..claim import Claim
    from ..context import Context, Look

CONTEXTS = ("", "mtlx", "kma", "karma", "arnold")
"""Render contexts of surface outputs, in order of preference."""


def bound(ctx: Context, claim: Claim, subset: Claim | None) -> UsdShade.Material | None:
    """The material bound to a prim, or to a subset of it: by strength, collections and purpose ("full" before all-purpose)."""
    prim: Usd.Prim = (subset or claim).prim
    api = UsdShade.MaterialBindingAPI(prim)
    material, relationship = api.ComputeBoundMaterial(UsdShade.Tokens.full)
    if material:
        return material
    if relationship and relationship.GetTargets():
        targets = ", ".join(str(t) for t in relationship.GetTargets())
        (subset or claim).skipped(
            str(relationship.GetName()), f"binds {targets}, which is no material", "it looks as if nothing were bound"
        )
    return None


def material_for(ctx: Context, claim: Claim, subset: Claim | None) -> Look | None:
    """See :meth:`Context.material_for`."""
    material = bound(ctx, claim, subset)
    look = None if material is None else _look(ctx, claim, material, subset)
    return glow.lit(ctx, claim, look, material is not None)


def _look(ctx: Context, claim: Claim, material: UsdShade.Material, subset: Claim | None) -> Look | None:
    cache: dict[str, Look | None] = ctx.__dict__.setdefault("_looks", {})
    path = str(material.GetPath())
    if path in cache:
        return cache[path]
    found = network(ctx).terminal(material, "surface", CONTEXTS)
    if found is None:
        volume = network(ctx).terminal(material, "volume", ("", "mtlx", "kma", "karma", "arnold", "cycles"))
        what = "a volume shader, which only volumes can have" if volume else "no surface shader that is known"
        ctx.report.skipped(path, "outputs:surface", f"has {what}", "surfaces look as if no material were bound")
        cache[path] = None
        return None
    builder = Builder(ctx, claim, material.GetPrim(), subset)
    look = surfaces.convert(builder, found[0], str(material.GetPrim().GetName()))
    _displacement(ctx, material)
    if not builder.of_the_prim:
        cache[path] = look
    return look


def _displacement(ctx: Context, material: UsdShade.Material) -> None:
    found = network(ctx).terminal(material, "displacement", CONTEXTS)
    surface = network(ctx).terminal(material, "surface", CONTEXTS)
    if found is not None and (surface is None or found[0].path != surface[0].path):
        ctx.report.skipped(material.GetPath(), "outputs:displacement", "displacement is not rendered", "surfaces are smooth")
