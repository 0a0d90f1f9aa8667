"""What UsdLux says that lights are, beside what a scene says. Numbers are chosen so that equal lights have equal ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from conftest import Converted
from expected_looks import digest, three
from pxr import Ar, Usd, UsdLux

Lamp = dict[str, Any]


def lamp_of(prim: Usd.Prim, m: np.ndarray, time: Usd.TimeCode) -> Lamp | None:
    """A light whose matrix to the world is ``m``; None for one that is off. By the documentation of ``usdLux/schema.usda``."""

    def get(name: str) -> Any:
        return prim.GetAttribute(f"inputs:{name}").Get(time)

    color = np.array(get("color"), dtype=float) * get("intensity") * 2.0 ** get("exposure")
    if get("enableColorTemperature"):
        color *= np.array(UsdLux.BlackbodyTemperatureAsRgb(get("colorTemperature")), dtype=float)
    if color.max() <= 0.0:
        return None

    def emitted(area: float) -> np.ndarray:
        return color / area if get("normalize") else color

    kind, place, axes = prim.GetTypeName(), m[:3, 3], m[:3, :3]
    away = np.linalg.inv(axes)[2] / np.linalg.norm(np.linalg.inv(axes)[2])
    lamp: Lamp
    match kind:
        case "DistantLight":
            solid = np.pi * np.sin(np.radians(0.5 * get("angle"))) ** 2
            towards = axes[:, 2] / np.linalg.norm(axes[:, 2])
            return {"kind": "distant", "towards": towards, "irradiance": emitted(solid) * solid, "angle": get("angle")}
        case "DomeLight":
            file = get("texture:file")
            if file is None or not file.path:
                return {"kind": "dome", "emission": color}
            asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(file.resolvedPath))
            with asset:
                content = bytes(asset.GetBuffer())
            return {"kind": "dome", "emission": color, "image": digest(content), "turn": axes / np.cbrt(np.linalg.det(axes))}
        case "SphereLight":
            radius = get("radius") * uniform(axes)
            area = 4.0 * np.pi * radius**2
            if prim.GetAttribute("treatAsPoint").Get(time) and not prim.HasAPI(UsdLux.ShapingAPI):
                # The section that a far sphere shows; CONVENTIONS.md: one without area counts as one of area 1.
                power = emitted(area) * (np.pi * radius**2) if radius > 0.0 else 0.25 * color
                return {"kind": "point", "place": place, "intensity": power}
            lamp = {"kind": "sphere", "place": place, "radius": radius, "emission": emitted(area)}
        case "RectLight":
            u, v = get("width") * axes[:, 0], get("height") * axes[:, 1]
            area = float(np.linalg.norm(np.cross(u, v)))
            # Whichever edge is called u: the sum of their squares, and the area towards −z.
            lamp = {"kind": "rect", "place": place, "edges": np.outer(u, u) + np.outer(v, v), "area": -area * away, "emission": emitted(area)}
        case "DiskLight":
            radius = get("radius") * uniform(axes)
            lamp = {"kind": "disk", "place": place, "radius": radius, "normal": -away, "emission": emitted(np.pi * radius**2)}
        case "CylinderLight":
            radius, axis = get("radius") * uniform(axes), get("length") * axes[:, 0]
            area = 2.0 * np.pi * radius * np.linalg.norm(axis)
            lamp = {"kind": "cylinder", "place": place, "radius": radius, "axis": np.outer(axis, axis), "emission": emitted(area)}
        case _:
            raise AssertionError(f"no stage has a {kind}")
    if prim.HasAPI(UsdLux.ShapingAPI):
        # The half angle of the cone, about −z.
        lamp["cone"] = {
            "axis": -axes[:, 2] / np.linalg.norm(axes[:, 2]), "angle": 2.0 * get("shaping:cone:angle"), "softness": get("shaping:cone:softness"),
            "focus": get("shaping:focus"), "tint": three(get("shaping:focusTint")),
        }  # fmt: skip
    return lamp


def uniform(axes: np.ndarray) -> float:
    """The factor of a transform that has one."""
    lengths = np.linalg.norm(axes, axis=0)
    assert np.ptp(lengths) < 1e-6 * lengths.max(), "no stage stretches a light"
    return float(lengths.mean())


def found_lamps(converted: Converted) -> list[Lamp]:
    """All lights of a scene: those of its list, and shapes that emit and reflect nothing."""
    out: list[Lamp] = []
    for light in converted.scene.get("lights", []):
        match light["type"]:
            case "distant":
                towards = np.array(light["to_light"])
                out.append({"kind": "distant", "towards": towards, "irradiance": three(light["irradiance"]), "angle": light["angle_deg"]})
            case "point":
                out.append({"kind": "point", "place": np.array(light["position"]), "intensity": three(light["intensity"])})
            case "environment" if "image" in light:
                turn = np.array(light.get("transform", np.eye(4)))[:3, :3]
                image = digest(converted.path(light["image"]).read_bytes())
                out.append({"kind": "dome", "emission": three(light["scale"]), "image": image, "turn": turn})
            case "environment":
                out.append({"kind": "dome", "emission": three(light["radiance"])})
            case other:
                raise AssertionError(f"no stage has a {other}")
    return out + [_shape(s) for s in converted.scene.get("shapes", []) if "emission" in s and "material" not in s]


def _shape(shape: Lamp) -> Lamp:
    lamp: Lamp
    match shape["type"]:
        case "sphere":
            lamp = {"kind": "sphere", "place": np.array(shape["center"]), "radius": shape["radius"]}
        case "rectangle":
            corner, u, v = (np.array(shape[k]) for k in ("corner", "edge_u", "edge_v"))
            lamp = {"kind": "rect", "place": corner + 0.5 * (u + v), "edges": np.outer(u, u) + np.outer(v, v), "area": np.cross(u, v)}
        case "disk":
            lamp = {"kind": "disk", "place": np.array(shape["center"]), "radius": shape["radius"], "normal": np.array(shape["normal"])}
        case "cylinder":
            base, axis = np.array(shape["base"]), np.array(shape["axis"])
            lamp = {"kind": "cylinder", "place": base + 0.5 * axis, "radius": shape["radius"], "axis": np.outer(axis, axis)}
        case other:
            raise AssertionError(f"no stage has a {other} that is a light")
    lamp["emission"] = three(shape["emission"])
    if (s := shape.get("shaping")) is not None:
        lamp["cone"] = {
            "axis": np.array(s["axis"]), "angle": s["angle_deg"], "softness": s.get("softness", 0.0), "focus": s.get("focus", 0.0),
            "tint": three(s.get("focus_tint", 0.0)),
        }  # fmt: skip
    return lamp
