"""What UsdLux's specification says of a light, by quadrature: independent of the converter.

A stage is read through usd-core; the formulas are those of the documentation in ``pxr/usd/usdLux/schema.usda``.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from pxr import Usd, UsdGeom, UsdLux

N = 600


def smoothstep(x: np.ndarray, a: float, b: float) -> np.ndarray:
    if a == b:
        return (x > a).astype(float)
    t = np.clip((x - a) / (b - a), 0, 1)
    return t * t * (3 - 2 * t)


def get(prim: Usd.Prim, name: str) -> Any:
    return prim.GetAttribute(name).Get()


def luminance_factor(prim: Usd.Prim) -> np.ndarray:
    """Everything but ``normalize`` and shaping."""
    color = np.array(get(prim, "inputs:color"), dtype=float) * get(prim, "inputs:intensity") * 2 ** get(prim, "inputs:exposure")
    if get(prim, "inputs:enableColorTemperature"):
        color *= np.array(UsdLux.BlackbodyTemperatureAsRgb(get(prim, "inputs:colorTemperature")), dtype=float)
    return color


def shaping(prim: Usd.Prim, axis: np.ndarray, w: np.ndarray) -> np.ndarray:
    """Factor in the directions of emission ``w``, (..., 3)."""
    if not prim.HasAPI(UsdLux.ShapingAPI):
        return np.ones((*w.shape[:-1], 3))
    api = UsdLux.ShapingAPI(prim)
    cosine = np.clip(w @ axis, -1, 1)
    theta = np.arccos(cosine)
    cut = np.radians(api.GetShapingConeAngleAttr().Get())
    soft = np.clip(api.GetShapingConeSoftnessAttr().Get(), 0, 1)
    inside = (1 - smoothstep(theta, cut * (1 - soft), cut)) * (theta <= cut)
    focus = np.abs(cosine) ** max(api.GetShapingFocusAttr().Get(), 0)
    tint = np.array(api.GetShapingFocusTintAttr().Get(), dtype=float)
    return inside[..., None] * (focus[..., None] + (1 - focus[..., None]) * tint)


def surface(prim: Usd.Prim) -> tuple[Callable[[np.ndarray, np.ndarray], np.ndarray], bool]:
    """The light's surface over the unit square in its own space, and whether it is the −z side of a plane."""
    kind = prim.GetTypeName()
    if kind == "RectLight":
        w, h = get(prim, "inputs:width"), get(prim, "inputs:height")
        return lambda s, t: np.stack([(s - 0.5) * w, (t - 0.5) * h, 0 * s], -1), True
    if kind == "DiskLight":
        r = get(prim, "inputs:radius")
        return lambda s, t: r * np.stack([s * np.cos(2 * np.pi * t), s * np.sin(2 * np.pi * t), 0 * s], -1), True
    if kind == "SphereLight":
        r = get(prim, "inputs:radius")

        def sphere(s: np.ndarray, t: np.ndarray) -> np.ndarray:
            a, b = np.pi * s, 2 * np.pi * t
            return r * np.stack([np.sin(a) * np.cos(b), np.sin(a) * np.sin(b), np.cos(a)], -1)

        return sphere, False
    if kind == "CylinderLight":
        r, length = get(prim, "inputs:radius"), get(prim, "inputs:length")
        return lambda s, t: np.stack([(s - 0.5) * length, r * np.cos(2 * np.pi * t), r * np.sin(2 * np.pi * t)], -1), False
    raise ValueError(kind)


def irradiance(prim: Usd.Prim, at: Any, normal: Any, texture: Callable[..., np.ndarray] | None = None) -> np.ndarray:
    """On a plane through ``at``: ∫ L cos θ cos θ' / d² dA over the light's surface, by the midpoint rule."""
    m = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
    shape, flat = surface(prim)
    place = lambda p: p @ m[:3, :3].T + m[:3, 3]  # noqa: E731
    s, t = np.meshgrid((np.arange(N) + 0.5) / N, (np.arange(N) + 0.5) / N, indexing="ij")
    e = 1e-5
    p = place(shape(s, t))
    ds = (place(shape(s + e, t)) - place(shape(s - e, t))) / (2 * e)
    dt = (place(shape(s, t + e)) - place(shape(s, t - e))) / (2 * e)
    area = np.cross(ds, dt) / N**2
    size = np.linalg.norm(area, axis=-1)
    n = area / np.maximum(size, 1e-300)[..., None]
    if flat:
        # The normal of the side that faced −z: normals go with the inverse transpose.
        out = np.linalg.inv(m[:3, :3]).T @ np.array([0, 0, -1.0])
        n = np.broadcast_to(out / np.linalg.norm(out), n.shape)
    else:
        n = n * np.sign(np.einsum("...i,...i", n, p - m[:3, 3]))[..., None]
    to_light = p - np.asarray(at, dtype=float)
    d2 = np.einsum("...i,...i", to_light, to_light)
    w = to_light / np.sqrt(d2)[..., None]
    facing = np.maximum(w @ np.asarray(normal, dtype=float), 0) * np.maximum(-np.einsum("...i,...i", w, n), 0)
    axis = m[:3, :3] @ np.array([0, 0, -1.0])
    axis /= np.linalg.norm(axis)
    radiance = luminance_factor(prim) * shaping(prim, axis, -w)
    if get(prim, "inputs:normalize"):
        radiance = radiance / size.sum()
    if texture is not None:
        radiance = radiance * texture(s, t)
    return (radiance * (facing * size / d2)[..., None]).sum(axis=(0, 1))
