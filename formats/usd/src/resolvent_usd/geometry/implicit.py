"""UsdGeom's implicit shapes: spheres are exact, cubes and planes are meshes, round shapes are fine ones."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ..claim import Claim
from ..context import Context, Look
from ..groups import similarity
from ..registry import converts
from ..report import InputError
from .glb import Triangles, write
from .looks import look_of

SIDES = 128
"""Sides of round shapes: a multiple of four, so that bounds are exact."""

Floats = NDArray[np.float64]


def _positive(claim: Claim, name: str) -> float:
    value = float(claim.get(name))
    if value <= 0:
        raise InputError(f"{claim.path}.{name}", f"is {value:g}: must be > 0")
    return value


def _prepare(ctx: Context, claim: Claim) -> Look:
    claim.take("doubleSided")
    claim.take("orientation")
    look = look_of(ctx, claim)
    if look.uv is not None:
        claim.approximated(
            f"primvars:{look.uv}", "implicit shapes have no texture coordinates", "textures are read at (0, 0)"
        )
    return look


def _flipped(claim: Claim) -> bool:
    return bool(claim.get("orientation") == UsdGeom.Tokens.leftHanded)


def _emit(ctx: Context, claim: Claim, look: Look, t: Triangles) -> None:
    if _flipped(claim):
        normals = None if t.normals is None else -t.normals
        t = Triangles(t.positions, t.indices[:, ::-1], normals, t.uvs)
    file = ctx.files.add(claim.prim.GetTypeName().lower(), ".glb", write(t))
    claim.group.add({"type": "gltf", "file": file, **look.shape}, claim.matrix)


@converts("Sphere")
def sphere(ctx: Context, claim: Claim) -> None:
    """An exact sphere, or an ellipsoid where the transform stretches."""
    look = _prepare(ctx, claim)
    radius = _positive(claim, "radius")
    # Emission needs meshes where a transform stretches; so does an inside that is out.
    emits = "emission" in look.shape and (claim.group is not ctx.world or similarity(claim.matrix) is None)
    if emits or (_flipped(claim) and "emission" in look.shape):
        claim.approximated("", f"a stretched sphere that emits becomes a mesh of {SIDES} sides", "its silhouette is a polygon")
        profile = _arc(radius, -np.pi / 2, np.pi / 2, SIDES // 2)
        _emit(ctx, claim, look, revolve(*profile, axis="Z"))
        return
    claim.group.add({"type": "sphere", "center": [0.0, 0.0, 0.0], "radius": radius, **look.shape}, claim.matrix)


@converts("Cube")
def cube(ctx: Context, claim: Claim) -> None:
    """Six faces."""
    look = _prepare(ctx, claim)
    h = 0.5 * _positive(claim, "size")
    corners = np.array([[x, y, z] for z in (-h, h) for y in (-h, h) for x in (-h, h)])
    quads = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])
    _emit(ctx, claim, look, Triangles(corners, _cut(quads)))


@converts("Plane")
def plane(ctx: Context, claim: Claim) -> None:
    """A rectangle; its normal is the axis."""
    look = _prepare(ctx, claim)
    w, length = 0.5 * _positive(claim, "width"), 0.5 * _positive(claim, "length")
    # Width along x (z for the x axis), length along y (z for the y axis): UsdGeom's schema.
    u, v = {
        "X": ([0.0, 0.0, w], [0.0, length, 0.0]),
        "Y": ([w, 0.0, 0.0], [0.0, 0.0, length]),
        "Z": ([w, 0.0, 0.0], [0.0, length, 0.0]),
    }[_axis(claim)]
    a, b = np.array(u), np.array(v)
    normal = {"X": [1.0, 0.0, 0.0], "Y": [0.0, 1.0, 0.0], "Z": [0.0, 0.0, 1.0]}[_axis(claim)]
    corners = np.array([-a - b, a - b, a + b, b - a])
    quad = np.array([[0, 1, 2, 3]])
    if np.dot(np.cross(a, b), normal) < 0:
        quad = quad[:, ::-1]
    _emit(ctx, claim, look, Triangles(corners, _cut(quad)))


@converts("Cylinder", "Cylinder_1")
def cylinder(ctx: Context, claim: Claim) -> None:
    """A tube with caps; the two radii of Cylinder_1 may differ."""
    height = 0.5 * _positive(claim, "height")
    bottom, top = _radii(claim)
    r = [0.0, bottom, bottom, top, top, 0.0]
    z = [-height, -height, -height, height, height, height]
    slope = np.array([2 * height, bottom - top]) / np.hypot(2 * height, bottom - top)
    n = [(0, -1), (0, -1), slope, slope, (0, 1), (0, 1)]
    _round(ctx, claim, np.array(r), np.array(z), np.array(n, dtype=float))


@converts("Cone")
def cone(ctx: Context, claim: Claim) -> None:
    """A cone with its base; the apex points along the axis."""
    height, radius = 0.5 * _positive(claim, "height"), _positive(claim, "radius")
    slope = np.array([2 * height, radius]) / np.hypot(2 * height, radius)
    n = np.array([(0, -1), (0, -1), slope, slope], dtype=float)
    _round(ctx, claim, np.array([0.0, radius, radius, 0.0]), np.array([-height, -height, -height, height]), n)


@converts("Capsule", "Capsule_1")
def capsule(ctx: Context, claim: Claim) -> None:
    """A cylinder between half spheres, beyond its height."""
    height = 0.5 * float(claim.get("height"))
    if height < 0:
        raise InputError(f"{claim.path}.height", f"is {2 * height:g}: must be >= 0")
    bottom, top = _radii(claim)
    if bottom != top:
        claim.approximated("radiusTop", "caps of different radii are half spheres", "the flank meets them with an edge")
    r0, z0, n0 = _arc(bottom, -np.pi / 2, 0.0, SIDES // 4)
    r1, z1, n1 = _arc(top, 0.0, np.pi / 2, SIDES // 4)
    if height == 0 and bottom == top:
        r1, z1, n1 = r1[1:], z1[1:], n1[1:]
    _round(ctx, claim, np.r_[r0, r1], np.r_[z0 - height, z1 + height], np.r_[n0, n1])


def _radii(claim: Claim) -> tuple[float, float]:
    if str(claim.prim.GetTypeName()).endswith("_1"):
        return _positive(claim, "radiusBottom"), _positive(claim, "radiusTop")
    radius = _positive(claim, "radius")
    return radius, radius


def _axis(claim: Claim) -> str:
    axis = str(claim.get("axis"))
    if axis not in "XYZ" or len(axis) != 1:
        raise InputError(f"{claim.path}.axis", f"is '{axis}': must be X, Y or Z")
    return axis


def _arc(radius: float, start: float, end: float, steps: int) -> tuple[Floats, Floats, Floats]:
    """A profile on a circle: distances from the axis, positions along it, normals."""
    a = np.linspace(start, end, steps + 1)
    c, s = np.cos(a), np.sin(a)
    c[np.abs(c) < 1e-15] = 0.0
    s[np.abs(s) < 1e-15] = 0.0
    return radius * c, radius * s, np.stack([c, s], axis=1)


def _round(ctx: Context, claim: Claim, r: Floats, z: Floats, normals: Floats) -> None:
    look = _prepare(ctx, claim)
    claim.approximated("", f"round shapes are meshes of {SIDES} sides", "silhouettes are polygons, normals are smooth")
    _emit(ctx, claim, look, revolve(r, z, normals, _axis(claim)))


def revolve(r: Floats, z: Floats, normals: Floats, axis: str) -> Triangles:
    """The surface of a profile that turns around an axis: distances, positions along the axis from the lowest up, and normals."""
    a = np.arange(SIDES) * (2 * np.pi / SIDES)
    c, s = np.cos(a), np.sin(a)
    for x in (c, s):
        x[np.abs(x) < 1e-15] = 0.0
    rings = len(r)
    p = np.stack([np.outer(r, c), np.outer(r, s), np.repeat(z[:, None], SIDES, axis=1)], axis=2)
    n = np.stack([np.outer(normals[:, 0], c), np.outer(normals[:, 0], s), np.repeat(normals[:, 1:], SIDES, axis=1)], axis=2)
    i, j = np.meshgrid(np.arange(rings - 1), np.arange(SIDES), indexing="ij")
    k = (j + 1) % SIDES
    quads = np.stack([i * SIDES + j, i * SIDES + k, (i + 1) * SIDES + k, (i + 1) * SIDES + j], axis=2).reshape(-1, 4)
    triangles = _cut(quads)
    # The axis' own points, and profiles that stand still, make triangles of no area.
    corners = p.reshape(-1, 3)[triangles]
    area = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    keep = area > 1e-14 * (np.abs(p).max() ** 2)
    # Right-handed turns: z to the axis.
    turn = {"X": [2, 0, 1], "Y": [1, 2, 0], "Z": [0, 1, 2]}[axis]
    return Triangles(p.reshape(-1, 3)[:, turn], triangles[keep], n.reshape(-1, 3)[:, turn])


def _cut(quads: NDArray[Any]) -> NDArray[Any]:
    return np.asarray(quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
