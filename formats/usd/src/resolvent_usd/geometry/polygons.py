"""Polygons to triangles, convex or not."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


def triangulate(points: NDArray[Any], counts: Ints, indices: Ints) -> tuple[Ints, Ints]:
    """Triangles of polygons.

    Returns (m, 3) positions in ``indices`` (corners, so that faceVarying data can follow) and the m faces they come from, in
    the order of the faces. Convex polygons become fans, others are cut by ear clipping.
    """
    if len(counts) and counts.min() == counts.max() <= 4:
        # What most meshes are, without looking for more.
        n = int(counts[0])
        ring = np.arange(len(indices)).reshape(-1, n)
        if n == 3:
            return ring, np.arange(len(counts))
        cut = (ring[:, :1] + np.array([0, 1, 2, 0, 2, 3])).reshape(-1, 2, 3)
        folded = np.flatnonzero(np.concatenate([_folded(points.take(part, axis=0)) for part in _parts(indices.reshape(-1, 4))]))
        cut[folded] = ring[folded][:, [0, 1, 3, 1, 2, 3]].reshape(-1, 2, 3)
        return cut.reshape(-1, 3), np.repeat(np.arange(len(counts)), 2)
    starts = np.cumsum(counts) - counts
    corners: list[Ints] = []
    faces: list[Ints] = []
    for n in np.unique(counts):
        which = np.flatnonzero(counts == n)
        ring = starts[which, None] + np.arange(n)
        if n == 3:
            corners.append(ring)
            faces.append(which)
            continue
        p = np.asarray(points[indices[ring]], dtype=float)
        cut = _quads(p) if n == 4 else _polygons(p)
        corners.append(np.take_along_axis(ring[:, None, :], cut, axis=2).reshape(-1, 3))
        faces.append(np.repeat(which, n - 2))
    if not corners:
        return np.empty((0, 3), dtype=np.int64), np.empty(0, dtype=np.int64)
    if len(corners) == 1:
        return corners[0], faces[0]
    face = np.concatenate(faces)
    order = np.argsort(face, kind="stable")
    return np.concatenate(corners)[order], face[order]


def _parts(faces: Ints) -> Iterator[Ints]:
    """Some faces at a time: so many that what is computed for them stays in the cache."""
    for start in range(0, len(faces), 1 << 14):
        yield faces[start : start + (1 << 14)]


def _quads(p: Floats) -> Ints:
    """Cuts (k, 4, 3) quadrilaterals from corner 0 to 2, and those with a reflex corner 1 or 3 from 1 to 3."""
    cut = np.empty((len(p), 2, 3), dtype=np.int64)
    cut[:] = [[0, 1, 2], [0, 2, 3]]
    cut[_folded(p)] = [[0, 1, 3], [1, 2, 3]]
    return cut


def _folded(p: NDArray[Any]) -> NDArray[np.bool_]:
    """True where the triangles of a cut from corner 0 to 2 turn different ways."""
    (ax, ay, az), (dx, dy, dz), (bx, by, bz) = ((p[:, k] - p[:, 0]).T for k in (1, 2, 3))
    first = (ay * dz - az * dy, az * dx - ax * dz, ax * dy - ay * dx)
    second = (dy * bz - dz * by, dz * bx - dx * bz, dx * by - dy * bx)
    return np.asarray(sum(u * v for u, v in zip(first, second, strict=True)) < 0)


def _polygons(p: Floats) -> Ints:
    """Cuts (k, n, 3) polygons into (k, n − 2, 3) triangles."""
    k, n, _ = p.shape
    q = p - p.mean(axis=1, keepdims=True)
    following = np.roll(q, -1, axis=1)
    normal = np.cross(q, following).sum(axis=1)  # Newell's, twice the area long
    e, f = q - np.roll(q, 1, axis=1), following - q
    turn = np.einsum("kni,ki->kn", np.cross(e, f), normal)
    # All corners turn the same way, and once around: a fan. (The sum of the turning angles tells a star from a convex polygon.)
    length = np.linalg.norm(normal, axis=1)[:, None]
    angle = np.arctan2(turn, np.einsum("kni,kni->kn", e, f) * np.maximum(length, 1e-300))
    convex = (turn >= 0).all(axis=1) & (angle.sum(axis=1) < 2.5 * np.pi)
    fan = np.stack([np.zeros(n - 2), np.arange(1, n - 1), np.arange(2, n)], axis=1).astype(np.int64)
    cut = np.broadcast_to(fan, (k, n - 2, 3)).copy()
    for i in np.flatnonzero(~convex):
        cut[i] = clip_ears(_flatten(q[i], normal[i]))
    return cut


def _flatten(p: Floats, normal: Floats) -> Floats:
    """Projection along the normal to 2D, the polygon counter-clockwise."""
    axis = int(np.argmax(np.abs(normal)))
    u, v = [(1, 2), (2, 0), (0, 1)][axis]
    flat = p[:, [u, v]]
    return flat if normal[axis] >= 0 else flat[:, ::-1]


def clip_ears(p: Floats) -> Ints:
    """Cuts a simple counter-clockwise polygon of n points into n − 2 triangles (Meisters 1975, "Polygons have ears").

    The first ear found is cut, and the search goes on behind it. A polygon that crosses itself gets n − 2 triangles as well: where
    no corner is an ear, the flattest one is cut.
    """
    ring = list(range(len(p)))
    out: list[tuple[int, int, int]] = []
    at = 0
    while len(ring) > 3:
        n = len(ring)
        best, best_area = at % n, -np.inf
        for step in range(n):
            j = (at + step) % n
            a, b, c = ring[j - 1], ring[j], ring[(j + 1) % n]
            area = _cross(p[a], p[b], p[c])
            if area > 0 and not _any_inside(p, ring, (a, b, c)):
                best = j
                break
            flat = -abs(area)
            if flat > best_area:
                best, best_area = j, flat
        j = best
        out.append((ring[j - 1], ring[j], ring[(j + 1) % n]))
        del ring[j]
        at = j
    out.append((ring[0], ring[1], ring[2]))
    return np.array(out, dtype=np.int64)


def _cross(a: Floats, b: Floats, c: Floats) -> float:
    return float((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]))


def _any_inside(p: Floats, ring: list[int], t: tuple[int, int, int]) -> bool:
    """True if a point of the ring lies in the triangle or on the cut; its own corners (also touching ones) do not count."""
    a, b, c = (p[i] for i in t)
    q = p[[i for i in ring if i not in t]]
    same = (q == a).all(axis=1) | (q == b).all(axis=1) | (q == c).all(axis=1)
    q = q[~same]

    def left(u: Floats, v: Floats) -> Floats:
        return np.asarray((v[0] - u[0]) * (q[:, 1] - u[1]) - (v[1] - u[1]) * (q[:, 0] - u[0]))

    return bool(((left(a, b) >= 0) & (left(b, c) >= 0) & (left(c, a) >= 0)).any())
