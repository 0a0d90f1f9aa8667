"""Lights with an area: rectangles, disks, spheres and cylinders.

Where a transform keeps a shape what it is, it is exact; an ellipse, an ellipsoid or an oblique cylinder becomes a fine
mesh of the same area. As the schema says of ``noMaterialResponse``, they reflect nothing and let nothing through: their
dark sides are black.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..claim import Claim
from ..context import Context
from ..geometry.glb import Triangles, write
from ..materials.glow import BLACK
from ..registry import converts
from ..report import InputError
from ..scene import Json, Matrix, rgb, rows
from . import areas
from .emission import Color, dark, radiance, shaping, value

Floats = NDArray[np.float64]
SIDES = 256
"""Of the polygon that stands for an ellipse."""


def _length(claim: Claim, name: str, default: float) -> float:
    found = float(value(claim, f"inputs:{name}", default))
    if found < 0.0:
        raise InputError(f"{claim.path}.inputs:{name}", f"is {found:g}: must not be negative")
    return found


def _add(ctx: Context, claim: Claim, shape: Json, color: Color) -> None:
    ctx.scene.shapes.append({**shape, "emission": rgb(color), **shaping(claim, claim.matrix)})


def _nothing(claim: Claim, what: str) -> None:
    """A light without area: by the specification it emits nothing."""
    claim.skipped(what, "is 0: the light has no area, and emission is per area", "the light is not there")
    claim.take_prefix("inputs:")


def _normal(matrix: Matrix) -> Floats:
    """The unit normal of the side of the plane z = 0 that faces −z."""
    n = -np.linalg.inv(matrix[:3, :3])[2]
    return np.asarray(n / np.linalg.norm(n))


def _round(u: Floats, v: Floats) -> bool:
    """True if two half axes span a circle."""
    a, b = np.linalg.norm(u), np.linalg.norm(v)
    return bool(abs(a - b) <= 1e-6 * a and abs(u @ v) <= 1e-6 * a * b)


@converts("RectLight", per_instance=True)
def rect(ctx: Context, claim: Claim) -> None:
    """A rectangle in the plane z = 0 that emits towards −z, with its image upright as seen from there."""
    width, height = _length(claim, "width", 1.0), _length(claim, "height", 1.0)
    m = claim.matrix
    u, v = -width * m[:3, 0], height * m[:3, 1]
    size = float(np.linalg.norm(np.cross(u, v)))
    color = radiance(claim, size)
    texture = value(claim, "inputs:texture:file")
    if dark(claim, color):
        return
    if size == 0.0:
        _nothing(claim, "inputs:width")
        return
    # The image's lower left corner is at (+x, −y).
    corner = m[:3, 3] - 0.5 * (u + v)
    mirrored = bool(np.cross(u, v) @ _normal(m) < 0.0)
    if mirrored:
        corner, u = corner + u, -u
    shape: Json = {"type": "rectangle", "corner": rgb(corner), "edge_u": rgb(u), "edge_v": rgb(v)}
    if texture is not None and texture.path:
        image: Json = {"file": ctx.file(claim, "inputs:texture:file", texture), "wrap": "clamp"}
        if mirrored:
            image["uv_transform"] = {"scale": [-1.0, 1.0], "offset": [1.0, 0.0]}
        shape["emission_texture"] = ctx.scene.texture(claim.path, image)
    _add(ctx, claim, shape, color)


@converts("DiskLight", per_instance=True)
def disk(ctx: Context, claim: Claim) -> None:
    """A disk in the plane z = 0 that emits towards −z."""
    radius = _length(claim, "radius", 0.5)
    m = claim.matrix
    u, v = radius * m[:3, 0], radius * m[:3, 1]
    size = areas.ellipse(u, v)
    color = radiance(claim, size)
    if dark(claim, color):
        return
    if size == 0.0:
        _nothing(claim, "inputs:radius")
        return
    normal = _normal(m)
    if _round(u, v):
        shape: Json = {"type": "disk", "center": rgb(m[:3, 3]), "normal": rgb(normal), "radius": float(np.linalg.norm(u))}
    else:
        shape = _mesh(ctx, claim, *areas.ellipse_mesh(u, v, normal, SIDES), "an ellipse")
    _add(ctx, claim, shape, color)


@converts("SphereLight", per_instance=True)
def sphere(ctx: Context, claim: Claim) -> None:
    """A sphere that emits outwards, or a point."""
    radius = _length(claim, "radius", 0.5)
    m = claim.matrix
    axes = radius * m[:3, :3]
    point = bool(claim.get("treatAsPoint", False))
    if radius == 0.0 and point and not bool(value(claim, "inputs:normalize", False)):
        claim.approximated(
            "treatAsPoint",
            "a sphere of radius 0 has no area, so that its emission per area is no light",
            "its power is that of a sphere of area 1, as if normalize were on",
        )
    size = areas.ellipsoid(axes)
    color = radiance(claim, size)
    if dark(claim, color):
        claim.take("inputs:shaping")
        return
    shaped = shaping(claim, m)
    if radius == 0.0 and not point:
        _nothing(claim, "inputs:radius")
        return
    if point and not shaped:
        # From far away the sphere shows its section, a quarter of its area. Without area, L is that of area 1.
        section = 0.25 * (size if size > 0.0 else 1.0)
        ctx.scene.lights.append({"type": "point", "position": rgb(m[:3, 3]), "intensity": rgb(color * section)})
        return
    if radius == 0.0:
        # A cone needs a surface: one so small that it makes no difference, of the same power.
        radius = 1e-4 / ctx.meters_per_unit
        axes = radius * m[:3, :3] / np.cbrt(abs(np.linalg.det(m[:3, :3])))
        color = color / areas.ellipsoid(axes)
    if areas.is_similar(axes):
        shape: Json = {"type": "sphere", "center": rgb(m[:3, 3]), "radius": float(np.linalg.norm(axes[:, 0]))}
    else:
        shape = _mesh(ctx, claim, *areas.ellipsoid_mesh(axes), "an ellipsoid")
    _add(ctx, claim, shape, color)


@converts("CylinderLight", per_instance=True)
def cylinder(ctx: Context, claim: Claim) -> None:
    """The lateral surface of a cylinder along x that emits outwards."""
    radius, length = _length(claim, "radius", 0.5), _length(claim, "length", 1.0)
    # A hint for renderers without area lights.
    claim.take("treatAsLine")
    m = claim.matrix
    axis, u, v = length * m[:3, 0], radius * m[:3, 1], radius * m[:3, 2]
    size = areas.cylinder(axis, u, v)
    color = radiance(claim, size)
    if dark(claim, color):
        return
    if size == 0.0:
        _nothing(claim, "inputs:radius" if radius == 0.0 else "inputs:length")
        return
    straight = max(abs(axis @ u), abs(axis @ v)) <= 1e-6 * np.linalg.norm(axis) * np.linalg.norm(u)
    if _round(u, v) and straight:
        shape: Json = {
            "type": "cylinder",
            "base": rgb(m[:3, 3] - 0.5 * axis),
            "axis": rgb(axis),
            "radius": float(np.linalg.norm(u)),
        }
    else:
        shape = _mesh(ctx, claim, *areas.cylinder_mesh(axis, u, v, SIDES), "an oblique or elliptic cylinder")
    _add(ctx, claim, shape, color)


def _mesh(ctx: Context, claim: Claim, positions: Floats, indices: NDArray[np.int64], what: str) -> Json:
    """Triangles around the light's origin; counter-clockwise seen from where they emit to."""
    claim.approximated(
        "xformOp", f"the transform makes the light {what}", f"a mesh of {len(indices)} triangles with the same area emits"
    )
    name = "".join(c if c.isalnum() else "_" for c in claim.prim.GetName())[:40]
    triangles = Triangles(positions.astype(np.float32), indices.astype(np.uint32), None, None)
    file = ctx.files.add(name, ".glb", write(triangles))
    place = np.eye(4)
    place[:3, 3] = claim.matrix[:3, 3]
    black = ctx.scene.material("black", BLACK)
    return {"type": "gltf", "file": file, "material": black, "transform": rows(place)}
