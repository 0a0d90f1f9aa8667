"""Meshes that are lights: MeshLightAPI, LightAPI on other shapes, and GeometryLight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from pxr import UsdLux

from ..context import Look
from ..scene import Json, rgb

if TYPE_CHECKING:
    from ..claim import Claim
    from ..context import Context

BLACK: Json = {"plugin": "diffuse", "params": {"reflectance": 0.0}}


def lit(ctx: Context, claim: Claim, look: Look | None, bound: bool) -> Look | None:
    """The look of a prim, with the emission of the light that it is, if any."""
    light = _light(ctx, claim)
    if light is None:
        return look
    from ..lights.emission import radiance, shaping

    prim = light.prim
    color = radiance(light, _area(ctx, claim, light))
    mode = str(UsdLux.LightAPI(prim).GetMaterialSyncModeAttr().Get() or "noMaterialResponse")
    shaped = shaping(light, claim.matrix)
    if mode == "noMaterialResponse" or not bound or look is None:
        black = ctx.scene.material("black", BLACK)
        if color.max() == 0.0:
            return Look({"material": black})
        return Look({"material": black, "emission": rgb(color), **shaped})
    shape = dict(look.shape)
    glow = shape.pop("emission", None)
    texture = shape.pop("emission_texture", None)
    if mode == "independent":
        light.approximated(
            "light:materialSyncMode", "surfaces show the same emission to all rays", "the mesh is seen as bright as it shines"
        )
        return Look({**shape, "emission": rgb(color), **shaped} if color.max() > 0.0 else shape, look.uv, look.colors)
    if glow is None:
        light.approximated(
            "light:materialSyncMode",
            "materialGlowTintsLight: light is the material's glow times the light's, and the material does not glow",
            "the mesh does not shine",
        )
        return Look(shape, look.uv, look.colors)
    if not np.allclose(color, 1.0):
        light.approximated(
            "light:materialSyncMode", "surfaces show the same emission to all rays", "the mesh is seen as bright as it shines"
        )
    product = np.asarray(glow) * color
    if product.max() > 0.0:
        shape |= {"emission": rgb(product), **shaped}
        if texture is not None:
            shape["emission_texture"] = texture
    return Look(shape, look.uv, look.colors)


def _light(ctx: Context, claim: Claim) -> Claim | None:
    """The claim of the prim whose light inputs count."""
    if claim.prim.HasAPI(UsdLux.LightAPI):
        return claim
    targets = _geometry_lights(ctx)
    path = targets.get(str(claim.prim.GetPath()))
    if path is None:
        return None
    light = ctx.claim(ctx.stage.GetPrimAtPath(path), claim.matrix, claim.group)
    light.take("geometry")
    return light


def _geometry_lights(ctx: Context) -> dict[str, str]:
    """Geometry that a visible GeometryLight names, with the light's path."""
    known: dict[str, str] | None = ctx.__dict__.get("_geometry_lights")
    if known is None:
        known = {}
        for prim in ctx.stage.Traverse():
            if prim.GetTypeName() == "GeometryLight":
                light = UsdLux.GeometryLight(prim)
                if light.ComputeVisibility(ctx.time) != "invisible":
                    for target in light.GetGeometryRel().GetForwardedTargets():
                        known[str(target)] = str(prim.GetPath())
        ctx.__dict__["_geometry_lights"] = known
    return known


def _area(ctx: Context, claim: Claim, light: Claim) -> float:
    """Area in the world of the mesh's polygons, for ``normalize``."""
    if not UsdLux.LightAPI(light.prim).GetNormalizeAttr().Get(ctx.time):
        return 1.0
    points = claim.array("points", float, 3)
    counts, indices = claim.array("faceVertexCounts", int), claim.array("faceVertexIndices", int)
    if points is None or counts is None or indices is None or not len(counts):
        light.approximated("inputs:normalize", "the area of this shape is not known", "its emission is not divided by it")
        return 1.0
    if claim.group is not ctx.world:
        light.approximated("inputs:normalize", "the mesh is instanced", "its area without the instance's transform is used")
    if claim.get("subdivisionScheme") != "none":
        light.approximated("inputs:normalize", "the mesh is a subdivision surface", "the area of its cage is used")
    placed = points @ claim.matrix[:3, :3].T
    first = np.cumsum(counts) - counts
    # Fans around each polygon's first corner; the cross products add up before their length is taken.
    face = np.repeat(np.arange(len(counts)), np.maximum(counts - 2, 0))
    step = np.arange(len(face)) - np.repeat(np.cumsum(counts - 2) - (counts - 2), counts - 2)
    a = placed[indices[first[face]]]
    b, c = placed[indices[first[face] + step + 1]], placed[indices[first[face] + step + 2]]
    cross = np.cross(b - a, c - a)
    sums = np.zeros((len(counts), 3))
    np.add.at(sums, face, cross)
    return float(0.5 * np.linalg.norm(sums, axis=1).sum())
