"""What surfaces without a bound material look like: displayColor and displayOpacity."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..claim import Claim
from ..context import Context, Look
from ..scene import Json
from . import primvars

GREY = (0.18, 0.18, 0.18)
"""The fallback of displayColor in OpenUSD's imaging."""


def look_of(ctx: Context, claim: Claim, subset: Claim | None = None, corners: bool = False) -> Look:
    """The bound material, else one of displayColor; ``corners``: the shape can have colours at its corners."""
    for part in (claim, subset):
        if part is not None:
            part.take_schema("MaterialBindingAPI")
            part.take_prefix("material:binding")
    look = ctx.material_for(claim, subset)
    if look is not None:
        # Of effect without a material only; primvar readers of a material take it on their own.
        claim.take("primvars:displayColor", "primvars:displayColor:indices")
        claim.take("primvars:displayOpacity", "primvars:displayOpacity:indices")
        return look
    if corners and (_varies(claim, "displayColor") or _varies(claim, "displayOpacity")):
        return Look({"material": _corner_material(ctx, claim)}, colors=True)
    return Look({"material": display_material(ctx, claim)})


def _varies(claim: Claim, name: str) -> bool:
    primvar = primvars.read(claim, name)
    return primvar is not None and len(primvar.values) > 1 and bool((primvar.values != primvar.values[0]).any())


def _corner_material(ctx: Context, claim: Claim) -> str:
    """A diffuse material of the colours at the corners; their alpha is the opacity."""
    color = ctx.scene.texture("displayColor", {"vertex_color": True})
    material: Json = {"plugin": "diffuse", "params": {"reflectance": {"texture": color}}}
    opacity = primvars.read(claim, "displayOpacity")
    if opacity is not None and len(opacity.values) and float(np.min(opacity.values)) < 1.0:
        alpha = ctx.scene.texture("displayOpacity", {"vertex_color": True, "channel": "a"})
        material = {"plugin": "mask", "params": {"opacity": {"texture": alpha}, "bsdf": material}}
    return ctx.scene.material("displayColor", material)


def display_material(ctx: Context, claim: Claim) -> str:
    """A diffuse material of the prim's displayColor; where that varies, of its mean."""
    color = _mean(claim, "displayColor", 3)
    opacity = _mean(claim, "displayOpacity", 1)
    rgb = np.clip(GREY if color is None else color, 0.0, 1.0)
    material: Json = {"plugin": "diffuse", "params": {"reflectance": [round(float(x), 9) for x in rgb]}}
    if opacity is not None and opacity[0] < 1.0:
        share = float(np.clip(opacity[0], 0.0, 1.0))
        material = {"plugin": "mask", "params": {"opacity": round(share, 9), "bsdf": material}}
    return ctx.scene.material("displayColor", material)


def _mean(claim: Claim, name: str, size: int) -> NDArray[Any] | None:
    primvar = primvars.read(claim, name)
    if primvar is None or len(primvar.values) == 0:
        return None
    values = np.asarray(primvar.values, dtype=float).reshape(len(primvar.values), -1)
    if values.shape[1] != size:
        claim.skipped(f"primvars:{name}", f"has {values.shape[1]} components, not {size}", "the fallback is used")
        return None
    if len(values) > 1 and np.ptp(values, axis=0).max() > 0:
        claim.approximated(f"primvars:{name}", "it varies over the surface", "its mean is shown")
    return np.asarray(values.mean(axis=0))
