"""UsdGeom BasisCurves: tubes, or ribbons where normals are authored."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ..claim import Claim
from ..context import Context
from ..registry import converts
from ..report import InputError
from . import primvars
from .glb import Triangles, write
from .looks import look_of
from .mesh import no_motion

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]

STEPS = 8
"""Straight pieces of a cubic segment."""

# Weights of four control points for the powers 1, t, t², t³: rows are powers.
_BASIS = {
    "bezier": np.array([[1, 0, 0, 0], [-3, 3, 0, 0], [3, -6, 3, 0], [-1, 3, -3, 1]], dtype=float),
    "bspline": np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0,
    "catmullRom": np.array([[0, 2, 0, 0], [-1, 0, 1, 0], [2, -5, 4, -1], [-1, 3, -3, 1]]) / 2.0,
}


@converts("BasisCurves")
def basis_curves(ctx: Context, claim: Claim) -> None:
    """Converts curves to one mesh."""
    no_motion(claim)
    claim.take("doubleSided", "orientation")
    look = look_of(ctx, claim)
    points = claim.array("points", float, 3)
    counts = claim.array("curveVertexCounts", np.int64)
    kind, basis, wrap = (str(claim.get(name)) for name in ("type", "basis", "wrap"))
    if points is None or counts is None or len(counts) == 0:
        ctx.report.note(claim.path, "curves without curves")
        claim.take("widths", "normals")
        return
    if counts.min() < 0 or counts.sum() != len(points):
        raise InputError(f"{claim.path}.curveVertexCounts", f"adds up to {counts.sum()} where there are {len(points)} points")
    if kind == "cubic" and basis not in _BASIS:
        raise InputError(f"{claim.path}.basis", f"is '{basis}', which is none of: {', '.join(_BASIS)}")
    if wrap not in ("nonperiodic", "periodic", "pinned"):
        raise InputError(f"{claim.path}.wrap", f"is '{wrap}', which is none of: nonperiodic, periodic, pinned")
    width = _per_vertex(claim, "widths", counts, len(points), kind, basis, wrap)
    if width is None:
        claim.approximated("widths", "there are none", "a width of 1 is used")
        width = np.ones((len(points), 1))
    normals = _per_vertex(claim, "normals", counts, len(points), kind, basis, wrap)
    ribbons = normals is not None
    data = np.concatenate([points, width] + ([normals] if normals is not None else []), axis=1)
    sides = ctx.options.curve_sides
    consequence = "flat ribbons that face their normals" if ribbons else f"tubes of {sides} sides without caps"
    claim.approximated("", f"curves are meshes, {STEPS} straight pieces a segment", consequence)
    if look.uv is not None:
        claim.approximated(f"primvars:{look.uv}", "curves have no texture coordinates", "textures are read at (0, 0)")
    parts: list[Triangles] = []
    starts = np.cumsum(counts) - counts
    for n in np.unique(counts):
        if n < 2:
            claim.approximated("curveVertexCounts", "curves of less than two points", "they can't be seen")
            continue
        rows = starts[counts == n, None] + np.arange(n)
        lines, closed = evaluate(data[rows], kind, basis, wrap)
        if lines.shape[1] < 2:
            claim.approximated("curveVertexCounts", f"{n} points make no {basis} segment", "these curves can't be seen")
            continue
        parts.append(_ribbon(lines) if ribbons else _tube(lines, closed, sides))
    if not parts:
        return
    offsets = np.cumsum([0] + [len(t.positions) for t in parts[:-1]])
    joined = Triangles(
        np.concatenate([t.positions for t in parts]),
        np.concatenate([t.indices + o for t, o in zip(parts, offsets, strict=True)]),
        np.concatenate([t.normals for t in parts if t.normals is not None]),
    )
    file = ctx.files.add("curves", ".glb", write(joined))
    claim.group.add({"type": "gltf", "file": file, **look.shape}, claim.matrix)


def _per_vertex(
    claim: Claim, name: str, counts: Ints, points: int, kind: str, basis: str, wrap: str
) -> Floats | None:
    """Values at control points; varying ones (at the ends of segments) are spread linearly."""
    found = primvars.read(claim, name)
    if found is None:
        values = claim.array(name, float, None if name == "widths" else 3)
        schema = UsdGeom.BasisCurves(claim.prim)
        interpolation = schema.GetWidthsInterpolation() if name == "widths" else schema.GetNormalsInterpolation()
        if values is not None and len(values):
            found = primvars.Primvar(name, values, "constant" if len(values) == 1 else str(interpolation))
    claim.take(name)
    if found is None or len(found.values) == 0:
        return None
    values = np.asarray(found.values, dtype=float).reshape(len(found.values), -1)
    if found.interpolation == "constant":
        return np.repeat(values[:1], points, axis=0)
    if found.interpolation == "uniform" and len(values) == len(counts):
        return np.repeat(values, counts, axis=0)
    if len(values) == points:
        return values
    ends = np.array([_ends(int(n), kind, basis, wrap) for n in counts])
    if found.interpolation in ("varying", "faceVarying") and len(values) == ends.sum():
        at = np.concatenate([np.linspace(s, s + e - 1, n) for s, e, n in zip(np.cumsum(ends) - ends, ends, counts, strict=True)])
        low = np.floor(at).astype(np.int64)
        high = np.minimum(low + 1, len(values) - 1)
        return np.asarray(values[low] + (values[high] - values[low]) * (at - low)[:, None])
    raise InputError(f"{claim.path}.{name}", f"has {len(values)} {found.interpolation} elements for {points} points")


def _ends(n: int, kind: str, basis: str, wrap: str) -> int:
    """Number of varying values of a curve of n points (UsdGeom BasisCurves' table)."""
    closed = wrap == "periodic"
    if kind == "linear":
        return n
    if basis == "bezier":
        return n // 3 if closed else (n - 4) // 3 + 2
    return n if closed else (n if wrap == "pinned" else max(n - 2, 0))


def evaluate(data: Floats, kind: str, basis: str, wrap: str) -> tuple[Floats, bool]:
    """Points (c, m, k) along curves of control points (c, n, k), and whether the last joins the first."""
    closed = wrap == "periodic"
    n = data.shape[1]
    if kind == "linear":
        return data, closed
    if wrap == "pinned" and basis != "bezier":
        # A phantom point beyond each end makes the curve reach it: 2 p0 − p1 for both bases.
        first, last = 2 * data[:, :1] - data[:, 1:2], 2 * data[:, -1:] - data[:, -2:-1]
        data = np.concatenate([first, data, last], axis=1)
        n += 2
    stride = 3 if basis == "bezier" else 1
    segments = n // stride if closed else (n - 4) // stride + 1
    if segments < 1:
        return data[:, :0], closed
    at = (np.arange(segments)[:, None] * stride + np.arange(4)) % n
    if closed and basis == "catmullRom":
        at = (at - 1) % n
    t = np.arange(STEPS) / STEPS
    powers = np.stack([t**0, t, t**2, t**3], axis=1)
    weights = powers @ _BASIS[basis]
    out = np.einsum("ti,csik->cstk", weights, data[:, at]).reshape(len(data), -1, data.shape[2])
    if closed:
        return out, True
    end = np.einsum("i,cik->ck", np.ones(4) @ _BASIS[basis], data[:, at[-1]])
    return np.concatenate([out, end[:, None]], axis=1), False


def _tangents(p: Floats, closed: bool) -> Floats:
    if closed:
        d = np.roll(p, -1, axis=1) - np.roll(p, 1, axis=1)
    else:
        d = np.gradient(p, axis=1) if p.shape[1] > 2 else np.repeat(p[:, 1:] - p[:, :1], 2, axis=1)
    return _unit(d)


def _unit(v: Floats) -> Floats:
    length = np.linalg.norm(v, axis=-1, keepdims=True)
    return np.asarray(np.where(length > 0, v / np.maximum(length, 1e-300), [0.0, 0.0, 1.0]))


def _tube(lines: Floats, closed: bool, sides: int) -> Triangles:
    """Rings around the points of (c, m, 4) lines (x, y, z, width), turned as little as possible from one to the next."""
    p, radius = lines[..., :3], 0.5 * lines[..., 3]
    c, m = radius.shape
    t = _tangents(p, closed)
    frame = np.empty_like(p)
    axis = np.eye(3)[np.argmin(np.abs(t[:, 0]), axis=1)]
    frame[:, 0] = _unit(np.cross(t[:, 0], axis))
    for i in range(1, m):
        # Parallel transport: what is left of the last direction across the new tangent.
        last = frame[:, i - 1]
        along = np.einsum("ci,ci->c", last, t[:, i])[:, None]
        frame[:, i] = _unit(last - along * t[:, i])
    other = np.cross(t, frame)
    angle = np.arange(sides) * (2 * np.pi / sides)
    normals = frame[:, :, None] * np.cos(angle)[:, None] + other[:, :, None] * np.sin(angle)[:, None]
    positions = p[:, :, None] + normals * radius[..., None, None]
    return Triangles(positions.reshape(-1, 3), _grid(c, m, sides, closed), normals.reshape(-1, 3))


def _grid(c: int, m: int, sides: int, closed: bool) -> NDArray[Any]:
    rings = np.arange(m if closed else m - 1)
    k, i, j = np.meshgrid(np.arange(c), rings, np.arange(sides), indexing="ij")

    def at(ring: NDArray[Any], side: NDArray[Any]) -> NDArray[Any]:
        return np.asarray((k * m + ring % m) * sides + side % sides)

    quads = np.stack([at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)], axis=-1).reshape(-1, 4)
    return np.asarray(quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))


def _ribbon(lines: Floats) -> Triangles:
    """Bands across (c, m, 7) lines (x, y, z, width, normal)."""
    p, radius, n = lines[..., :3], 0.5 * lines[..., 3:4], lines[..., 4:7]
    c, m, _ = p.shape
    t = _tangents(p, False)
    across = _unit(np.cross(_unit(n), t))
    normals = _unit(np.cross(t, across))
    positions = np.stack([p - across * radius, p + across * radius], axis=2)
    k, i = np.meshgrid(np.arange(c), np.arange(m - 1), indexing="ij")
    first = (k * m + i) * 2
    quads = np.stack([first, first + 2, first + 3, first + 1], axis=-1).reshape(-1, 4)
    triangles = quads[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3)
    return Triangles(positions.reshape(-1, 3), triangles, np.repeat(normals.reshape(-1, 3), 2, axis=0))
