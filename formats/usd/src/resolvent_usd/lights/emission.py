"""What all lights share: LightAPI, and the controls of ShapingAPI and ShadowAPI."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import Usd, UsdLux, UsdShade

from ..claim import Claim
from ..report import InputError
from ..scene import Json, Matrix, rgb

Color = NDArray[np.float64]
LIGHT_SCHEMAS = ("LightAPI", "ShapingAPI", "ShadowAPI", "CollectionAPI", "MeshLightAPI", "VolumeLightAPI")
_UNPHYSICAL = "is not physical: light here falls where it falls"


def value(claim: Claim, name: str, default: Any = None) -> Any:
    """A light's input, followed along its connections; one that a shader computes is reported and has its own value."""
    attribute = claim.prim.GetAttribute(name)
    if attribute and attribute.HasAuthoredConnections():
        claim.take(name)
        for source in UsdShade.Utils.GetValueProducingAttributes(UsdShade.Input(attribute)):
            found = source.Get(claim.ctx.time)
            if UsdShade.Utils.GetType(source.GetName()) == UsdShade.AttributeType.Input and found is not None:
                claim.ctx.used.add((str(source.GetPrimPath()), source.GetName()))
                return found
        claim.skipped(name, "a shader is connected to this light input", "its unconnected value is used")
    return claim.get(name, default)


def radiance(claim: Claim, size: float) -> Color:
    """Emitted radiance (RGB); ``size`` is what ``normalize`` divides by.

    L = intensity · 2^exposure / size · color · blackbody(colorTemperature)
    """
    claim.take_schema(*LIGHT_SCHEMAS)
    scalar = float(value(claim, "inputs:intensity", 1.0)) * 2.0 ** float(value(claim, "inputs:exposure", 0.0))
    if bool(value(claim, "inputs:normalize", False)):
        if size > 0.0:
            scalar /= size
        else:
            claim.approximated("inputs:normalize", "the light has no area to be divided by", "it is taken as 1")
    color = np.asarray(value(claim, "inputs:color", (1.0, 1.0, 1.0)), dtype=float) * scalar
    temperature = float(value(claim, "inputs:colorTemperature", 6500.0))
    if bool(value(claim, "inputs:enableColorTemperature", False)):
        if not 1000.0 <= temperature <= 10000.0:
            claim.approximated(
                "inputs:colorTemperature", f"{temperature:g} K is not between 1000 and 10000 K", "the nearest of them is used"
            )
        color *= np.asarray(UsdLux.BlackbodyTemperatureAsRgb(temperature), dtype=float)
    if not np.isfinite(color).all() or color.max() > 1e30:
        raise InputError(claim.path, f"its emission is out of range: {color.tolist()}")
    if color.min() < 0.0:
        claim.approximated("inputs:intensity", "the light's emission is negative", "such channels are dark")
    _common(claim)
    return np.asarray(np.maximum(color, 0.0))


def _common(claim: Claim) -> None:
    """Controls that are not there."""
    for name in ("diffuse", "specular"):
        if float(value(claim, f"inputs:{name}", 1.0)) != 1.0:
            claim.skipped(
                f"inputs:{name}", f"a factor on the {name} response alone {_UNPHYSICAL}", "surfaces respond to all light alike"
            )
    for name, default in _SHADOW.items():
        found = value(claim, f"inputs:shadow:{name}", default)
        if not np.allclose(np.asarray(found, dtype=float), default):
            claim.skipped(f"inputs:shadow:{name}", f"this control of shadows {_UNPHYSICAL}", "shadows are as they are")
    if filters := claim.targets("light:filters"):
        names = ", ".join(map(str, filters))
        claim.skipped("light:filters", f"light filters are not converted ({names})", "the light shines unfiltered")
    for link, what in (("lightLink", "all surfaces and media are lit"), ("shadowLink", "everything casts shadows")):
        _link(claim, link, what)
    # Says what shader the light is; of use to renderers that have it.
    claim.take("light:shaderId", "light:materialSyncMode")
    shader = claim.prim.GetAttribute("light:shaderId")
    if shader and shader.HasAuthoredValue() and shader.Get() != claim.prim.GetPrimDefinition().GetAttributeFallbackValue("light:shaderId"):
        claim.skipped("light:shaderId", f"the light shader '{shader.Get()}' is not known", "the light is that of its type")
    for name in claim.prim.GetAuthoredPropertyNames():
        if name.startswith("light:shaderId:"):
            claim.skipped(name, "a light shader of another renderer", "the light is that of its type")


_SHADOW: dict[str, Any] = {
    "enable": True,
    "color": (0.0, 0.0, 0.0),
    "distance": -1.0,
    "falloff": -1.0,
    "falloffGamma": 1.0,
}


def _link(claim: Claim, name: str, consequence: str) -> None:
    prefix = f"collection:{name}"
    collection = Usd.CollectionAPI(claim.prim, name) if claim.prim.HasAPI(Usd.CollectionAPI, name) else None
    claim.take_prefix(prefix)
    if collection is None:
        return
    root = collection.GetIncludeRootAttr().Get()
    if root is False or claim.targets(f"{prefix}:includes") or claim.targets(f"{prefix}:excludes"):
        claim.skipped(prefix, "lights are not linked to geometry", consequence)


def shaping(claim: Claim, matrix: Matrix) -> Json:
    """The key ``shaping`` of a scene's shape, or nothing if all directions are alike."""
    prefix = "inputs:shaping:"
    applied = claim.prim.HasAPI(UsdLux.ShapingAPI)
    if not applied and not any(n.startswith(prefix) for n in claim.prim.GetAuthoredPropertyNames()):
        return {}
    if not applied:
        claim.take_prefix(prefix)
        claim.skipped("inputs:shaping", "ShapingAPI is not applied to the prim", "its inputs have no effect")
        return {}
    _no_ies(claim)
    angle = float(value(claim, f"{prefix}cone:angle", 90.0))
    softness = float(np.clip(value(claim, f"{prefix}cone:softness", 0.0), 0.0, 1.0))
    focus = max(float(value(claim, f"{prefix}focus", 0.0)), 0.0)
    tint = np.maximum(np.asarray(value(claim, f"{prefix}focusTint", (0.0, 0.0, 0.0)), dtype=float), 0.0)
    if angle <= 0.0:
        claim.approximated(f"{prefix}cone:angle", f"a cone of {angle:g}° lets nothing through", "one of 0.001° is used")
    if angle >= 180.0 and (focus == 0.0 or np.allclose(tint, 1.0)):
        return {}
    axis = -matrix[:3, 2] / np.linalg.norm(matrix[:3, 2])
    out: Json = {"axis": rgb(axis), "angle_deg": float(np.clip(2.0 * angle, 0.002, 360.0))}
    if softness > 0.0:
        out["softness"] = softness
    if focus > 0.0:
        out |= {"focus": focus, "focus_tint": rgb(tint)}
    return {"shaping": out}


def _no_ies(claim: Claim) -> None:
    prefix = "inputs:shaping:ies:"
    file = value(claim, f"{prefix}file")
    if file is not None and file.path:
        claim.skipped(f"{prefix}file", f"IES profiles are not read ('{file.path}')", "the light shines without its profile")
    claim.take(f"{prefix}file", f"{prefix}angleScale", f"{prefix}normalize")


def no_shaping(claim: Claim) -> None:
    """For lights whose shape has no axis of emission."""
    if claim.prim.HasAPI(UsdLux.ShapingAPI):
        claim.take_prefix("inputs:shaping:")
        claim.skipped("ShapingAPI", "only lights at a finite place have a cone", "the light shines without it")


def dark(claim: Claim, color: Color) -> bool:
    """True for a light that is off, which is no part of the scene."""
    if color.max() > 0.0:
        return False
    claim.ctx.report.note(claim.path, "a light without emission")
    claim.take_prefix("inputs:")
    claim.take("treatAsPoint", "treatAsLine")
    return True
