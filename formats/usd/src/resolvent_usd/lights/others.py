"""Lights made of geometry, portals, filters and lights of other renderers."""

from __future__ import annotations

from ..claim import Claim
from ..context import Context
from ..registry import converts
from .emission import LIGHT_SCHEMAS


@converts("GeometryLight")
def geometry_light(ctx: Context, claim: Claim) -> None:
    """Deprecated in USD: the geometry itself takes its emission from the light, see ``materials.glow``."""
    claim.take_schema(*LIGHT_SCHEMAS)
    targets = claim.targets("geometry")
    claim.take_prefix("inputs:")
    claim.take_prefix("light:")
    claim.take_prefix("collection:")
    lost = [str(t) for t in targets if not ctx.stage.GetPrimAtPath(t)]
    if lost or not targets:
        what = f"names {', '.join(lost)}, which is not there" if lost else "names no geometry"
        claim.skipped("GeometryLight", what, "the light is not there")


@converts("PortalLight")
def portal(ctx: Context, claim: Claim) -> None:
    """Guides the sampling of domes; the light is the same without it."""
    claim.take_schema(*LIGHT_SCHEMAS)
    for prefix in ("inputs:", "light:", "collection:"):
        claim.take_prefix(prefix)
    ctx.report.note(claim.path, "portals are of no use to this renderer")


@converts("PluginLight", "LightFilter", "PluginLightFilter")
def foreign(ctx: Context, claim: Claim) -> None:
    """What other renderers know the meaning of."""
    claim.take_schema(*LIGHT_SCHEMAS)
    for prefix in ("inputs:", "light:", "lightFilter:", "collection:", "info:"):
        claim.take_prefix(prefix)
    kind = str(claim.prim.GetTypeName())
    shader = claim.prim.GetAttribute("info:id").Get() or claim.prim.GetAttribute("lightFilter:shaderId").Get() or ""
    what = "a light" if kind == "PluginLight" else "a light filter"
    claim.skipped(kind, f"{what} of another renderer" + (f" ('{shader}')" if shader else ""), "it has no effect")
