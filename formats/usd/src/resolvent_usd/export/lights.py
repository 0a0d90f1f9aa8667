"""Lights, as UsdLux has them: the inverse of :mod:`resolvent_usd.lights`."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Usd, UsdLux

from ..scene import Json, Matrix
from .stage import Target, around, color, frame, matrix, place

_FORMATS = {"latlong": "latlong", "mirrored_ball": "mirroredBall", "angular": "angular", "vertical_cross": "cubeMapVerticalCross"}


def write(target: Target) -> None:
    """All entries of the scene's ``lights``."""
    for number, light in enumerate(target.scene.get("lights", [])):
        place_of = f"/lights/{number}"
        kind = light.get("type")
        name = f"{kind}_{number}"
        if kind == "environment":
            _dome(target, name, light)
        elif kind == "distant":
            _distant(target, name, light)
        elif kind == "point":
            lux = UsdLux.SphereLight.Define(target.stage, target.path(name))
            _emit(lux, np.asarray(_rgb(light["intensity"])) / np.pi)
            lux.CreateTreatAsPointAttr(True)
            lux.CreateRadiusAttr(1.0)
            place(lux, frame((1, 0, 0), (0, 1, 0), (0, 0, 1), light["position"]))
        elif kind == "rectangle":
            rectangle(target, name, light, light["radiance"])
        elif kind == "spot":
            _spot(target, name, place_of, light)
        else:
            target.report.skipped(place_of, str(kind), "USD has no light like it", "it is not in the stage")


def _rgb(value: Any) -> list[float]:
    return [float(x) for x in color(value)]


def _emit(lux: Any, radiance: Any, normalize: bool = False) -> None:
    """Intensity and colour of a radiance: the colour's largest component is 1."""
    array = np.asarray(radiance, dtype=float)
    most = float(array.max())
    lux.CreateIntensityAttr(most)
    lux.CreateColorAttr(color(array / most if most > 0.0 else array))
    if normalize:
        lux.CreateNormalizeAttr(True)


def _dome(target: Target, name: str, light: Json) -> None:
    lux = UsdLux.DomeLight.Define(target.stage, target.path(name))
    if "image" not in light:
        _emit(lux, _rgb(light["radiance"]))
        return
    _emit(lux, _rgb(light.get("scale", 1.0)))
    lux.CreateTextureFileAttr(target.asset(light["image"]))
    lux.CreateTextureFormatAttr(_FORMATS[light.get("mapping", "latlong")])
    place(lux, matrix(light.get("transform")))


def _distant(target: Target, name: str, light: Json) -> None:
    """Normalized, intensity is an irradiance."""
    lux = UsdLux.DistantLight.Define(target.stage, target.path(name))
    _emit(lux, _rgb(light["irradiance"]), normalize=True)
    lux.CreateAngleAttr(float(light.get("angle_deg", 0.0)))
    place(lux, around(light["to_light"]))


def _spot(target: Target, name: str, where: str, light: Json) -> None:
    """A small sphere with a cone; its edge is a smoothstep of the angle, not of its cosine."""
    radius = 1e-3
    lux = UsdLux.SphereLight.Define(target.stage, target.path(name))
    _emit(lux, np.asarray(_rgb(light["intensity"])) / (np.pi * radius**2))
    lux.CreateRadiusAttr(radius)
    outer = 0.5 * float(light["angle_deg"])
    inner = 0.5 * float(light["inner_angle_deg"] if "inner_angle_deg" in light else light["angle_deg"])
    shape = UsdLux.ShapingAPI.Apply(lux.GetPrim())
    shape.CreateShapingConeAngleAttr(outer)
    shape.CreateShapingConeSoftnessAttr(1.0 - inner / outer)
    turn = around(-np.asarray(light["direction"], dtype=float))
    turn[:3, 3] = light["position"]
    place(lux, turn)
    target.report.approximated(
        where, "spot", "UsdLux has no point that shines into a cone", f"a sphere of radius {radius:g}, whose edge falls by the angle"
    )


def rectangle(target: Target, name: str, shape: Json, radiance: Any, texture: Json | None = None) -> list[Usd.Prim]:
    """A rectangle that emits along edge_u × edge_v; of two sides, two of them."""
    corner, u, v = (np.asarray(shape[k], dtype=float) for k in ("corner", "edge_u", "edge_v"))
    n = np.cross(u, v)
    out = []
    for side in (1.0, -1.0) if shape.get("two_sided") else (1.0,):
        lux = UsdLux.RectLight.Define(target.stage, target.path(name))
        _emit(lux, _rgb(radiance))
        # Its own −x runs along edge_u, so that images lie as they do here; from behind, they are mirrored.
        along = -side * u
        up = n / np.linalg.norm(n)
        # Two dark backs in one plane would hide the lights.
        apart = 0.0 if side > 0.0 else 1e-4 * np.sqrt(np.linalg.norm(n))
        place(lux, frame(along, v, -side * up, corner + 0.5 * (u + v) - apart * up))
        if texture is not None:
            lux.CreateTextureFileAttr(target.asset(texture["file"]))
            settings = set(texture) - {"file", "wrap"}
            if settings or side < 0.0:
                what = ", ".join(sorted(settings)) or "two_sided"
                target.report.approximated(name, what, "UsdLux has no such setting of a texture", "the image is shown as it is")
        shaped(lux.GetPrim(), shape, np.asarray(lux.GetLocalTransformation()).T, target)
        out.append(lux.GetPrim())
    return out


def emitter(target: Target, name: str, shape: Json, to_world: Matrix) -> bool:
    """A round shape that emits and has no material, as a light; false if it is none."""
    kind = shape["type"]
    if shape.get("two_sided") or "interior" in shape:
        return False
    if kind == "sphere":
        lux: Any = UsdLux.SphereLight.Define(target.stage, target.path(name))
        lux.CreateRadiusAttr(float(shape["radius"]))
        local = frame((1, 0, 0), (0, 1, 0), (0, 0, 1), shape["center"])
        axis = shape.get("shaping", {}).get("axis")
        if axis is not None:
            local = around(-np.asarray(axis, dtype=float))
            local[:3, 3] = shape["center"]
    elif kind == "disk":
        lux = UsdLux.DiskLight.Define(target.stage, target.path(name))
        lux.CreateRadiusAttr(float(shape["radius"]))
        local = around(-np.asarray(shape["normal"], dtype=float))
        local[:3, 3] = shape["center"]
    elif kind == "cylinder":
        base, axis = np.asarray(shape["base"], dtype=float), np.asarray(shape["axis"], dtype=float)
        lux = UsdLux.CylinderLight.Define(target.stage, target.path(name))
        lux.CreateRadiusAttr(float(shape["radius"]))
        lux.CreateLengthAttr(float(np.linalg.norm(axis)))
        turn = around(axis)
        # Its axis is x.
        local = frame(turn[:3, 2], turn[:3, 0], turn[:3, 1], base + 0.5 * axis)
    else:
        return False
    _emit(lux, _rgb(shape["emission"]))
    place(lux, to_world @ local)
    shaped(lux.GetPrim(), shape, to_world @ local, target)
    return True


def shaped(prim: Usd.Prim, shape: Json, to_world: Matrix, target: Target) -> None:
    """ShapingAPI; its axis is the prim's own −z."""
    s = shape.get("shaping")
    if s is None:
        return
    api = UsdLux.ShapingAPI.Apply(prim)
    api.CreateShapingConeAngleAttr(0.5 * float(s.get("angle_deg", 360.0)))
    api.CreateShapingConeSoftnessAttr(float(s.get("softness", 0.0)))
    api.CreateShapingFocusAttr(float(s.get("focus", 0.0)))
    api.CreateShapingFocusTintAttr(color(s.get("focus_tint", 0.0)))
    own = -to_world[:3, 2] / np.linalg.norm(to_world[:3, 2])
    axis = np.asarray(s["axis"], dtype=float) / np.linalg.norm(s["axis"])
    if np.abs(own - axis).max() > 1e-6:
        target.report.approximated(
            str(prim.GetPath()), "shaping", "ShapingAPI's axis is the light's own −z", "the cone points along the light's normal"
        )


def material_free(shape: Json, materials: Json) -> bool:
    """True for a shape that reflects nothing."""
    name = shape.get("material")
    if name is None:
        return True
    block = materials.get(name, {})
    black = block.get("params", {}).get("reflectance")
    return block.get("plugin") == "diffuse" and black is not None and not np.any(black)


