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


def _parts(faces: Ints, size: int = 1 << 14) -> Iterator[Ints]:
    """Some faces at a time: so many that what is computed for them stays in the cache."""
    for start in range(0, len(faces), size):
        yield faces[start : start + size]


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
    fan = np.stack([np.zeros(n - 2), np.arange(1, n - 1), np.arange(2, n)], axis=1).astype(np.int64)
    cut = np.broadcast_to(fan, (k, n - 2, 3)).copy()
    for part in _parts(np.arange(k), max(1, 1 << 16 >> n.bit_length())):
        q = p[part] - p[part].mean(axis=1, keepdims=True)
        x, y, z = np.moveaxis(q, 2, 0)
        after, before = (np.roll(q, -1, axis=1), np.roll(q, 1, axis=1))
        # Newell's normal, twice the area long.
        normal = np.stack([c.sum(axis=1) for c in _cross_of((x, y, z), np.moveaxis(after, 2, 0))], axis=1)
        e, f = np.moveaxis(q - before, 2, 0), np.moveaxis(after - q, 2, 0)
        turn = sum(c * normal[:, i, None] for i, c in enumerate(_cross_of(e, f)))
        # All corners turn the same way, and once around: a fan. (The sum of the turning angles tells a star from a convex polygon.)
        length = np.maximum(np.linalg.norm(normal, axis=1)[:, None], 1e-300)
        angle = np.arctan2(turn, (e[0] * f[0] + e[1] * f[1] + e[2] * f[2]) * length)
        other = np.flatnonzero(~((turn >= 0).all(axis=1) & (angle.sum(axis=1) < 2.5 * np.pi)))
        if len(other):
            cut[part[other]] = _clip(_flatten(q[other], normal[other]))
    return cut


def _cross_of(a: Any, b: Any) -> tuple[Floats, Floats, Floats]:
    return a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]


def _flatten(p: Floats, normal: Floats) -> Floats:
    """Projections (k, n, 2) of polygons along their normals' largest component, counter-clockwise."""
    axis = np.argmax(np.abs(normal), axis=1)
    columns = np.array([(1, 2), (2, 0), (0, 1)])[axis]
    behind = np.take_along_axis(normal, axis[:, None], axis=1)[:, 0] < 0
    columns[behind] = columns[behind, ::-1]
    return np.take_along_axis(p, columns[:, None, :], axis=2)


MANY = 32
"""Corners of polygons up to which ears are sought in all polygons at once."""


def _clip(p: Floats) -> Ints:
    """Ear clipping of (k, n, 2) polygons."""
    k, n, _ = p.shape
    if n > MANY:
        return np.stack([clip_ears(q) for q in p])
    return np.concatenate([_clip_together(p[part]) for part in _parts(np.arange(k), max(1, (1 << 17) // n**2))])


def _clip_together(p: Floats) -> Ints:
    """What :func:`clip_ears` does, for many polygons."""
    k, n, _ = p.shape
    rows = np.arange(k)
    ring = np.broadcast_to(np.arange(n), (k, n)).copy()
    at = np.zeros(k, dtype=np.int64)
    out = np.empty((k, n - 2, 3), dtype=np.int64)
    for m in range(n, 3, -1):
        q = np.take_along_axis(p, ring[:, :, None], axis=1)
        b = np.moveaxis(q, 2, 0)
        a, c = np.roll(b, 1, axis=2), np.roll(b, -1, axis=2)
        area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])
        blocked = np.ones((k, m, m), dtype=bool)
        for u, v in ((a, b), (b, c), (c, a)):
            # Of each corner's triangle: which points lie left of its sides, and are not its corners (also touching ones).
            x, y = (b[i][:, None, :] - u[i][:, :, None] for i in (0, 1))
            blocked &= (v[0] - u[0])[:, :, None] * y - (v[1] - u[1])[:, :, None] * x >= 0
            blocked &= (x != 0) | (y != 0)
        ear = (area > 0) & ~blocked.any(axis=2)
        order = (at[:, None] + np.arange(m)) % m
        best = np.where(
            ear.any(axis=1),
            np.argmax(np.take_along_axis(ear, order, axis=1), axis=1),
            np.argmax(np.take_along_axis(-np.abs(area), order, axis=1), axis=1),
        )
        at = order[rows, best]
        out[:, n - m] = ring[rows[:, None], (at[:, None] + np.array([-1, 0, 1])) % m]
        keep = np.ones((k, m), dtype=bool)
        keep[rows, at] = False
        ring = ring[keep].reshape(k, m - 1)
    out[:, n - 3] = ring
    return out


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
