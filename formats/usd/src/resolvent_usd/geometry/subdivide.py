"""Catmull–Clark subdivision with creases, corners, boundaries and holes, whole levels at a time.

The rules are OpenSubdiv's, which USD's schema refers to: Catmull and Clark 1978 for smooth vertices, DeRose, Kass and Truong
1998 ("Subdivision surfaces in character animation") for semi-sharp creases, whose sharpness falls by one per level. After the
last level, vertices are moved to their limits, so that they lie on the surface itself.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

INFINITE = 10.0
"""Sharpness from which on an edge or a vertex stays sharp (OpenSubdiv's)."""


@dataclass(frozen=True)
class Edges:
    """Edges of a mesh."""

    ends: Ints
    """(e, 2)"""
    of_corner: Ints
    """For each corner the edge to the next one."""
    faces: Ints
    """How many faces each has."""
    sharpness: Floats


@dataclass(frozen=True)
class Cage:
    """A control mesh; ``data`` are the points, or any other values that are subdivided like them."""

    counts: Ints
    indices: Ints
    data: Floats
    """(v, k)"""
    crease_edges: Ints
    """(c, 2)"""
    crease_sharpness: Floats
    corner_sharpness: Floats
    """(v,)"""
    face: Ints
    """The face of the first cage that each face comes from."""
    corner: Floats | None = None
    """(indices, k): values per corner that are interpolated linearly."""
    known: Edges | None = None
    """The edges, if they are known: then the creases are in them."""


def _starts(counts: Ints) -> Ints:
    return np.asarray(np.cumsum(counts) - counts)


def _next(counts: Ints) -> Ints:
    """Position of the next corner of the same face."""
    following = np.arange(1, counts.sum() + 1)
    following[np.cumsum(counts) - 1] = _starts(counts)
    return following


def _edges(cage: Cage) -> Edges:
    if cage.known is not None:
        return cage.known
    a, b = cage.indices, cage.indices[_next(cage.counts)]
    v = len(cage.data)
    keys, of_corner, faces = np.unique(np.minimum(a, b) * v + np.maximum(a, b), return_inverse=True, return_counts=True)
    ends = np.stack([keys // v, keys % v], axis=1)
    sharpness = np.zeros(len(keys))
    if len(cage.crease_edges):
        c = np.sort(cage.crease_edges, axis=1)
        wanted = c[:, 0] * v + c[:, 1]
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        found = keys[at] == wanted
        np.maximum.at(sharpness, at[found], cage.crease_sharpness[found])
    # Boundaries are creases; so is what more than two faces share.
    sharpness[faces != 2] = INFINITE
    return Edges(ends, of_corner.reshape(-1), faces, sharpness)


def _decayed(sharpness: Floats) -> Floats:
    return np.where(sharpness >= INFINITE, INFINITE, np.maximum(sharpness - 1.0, 0.0))


def _sum_at(where: Ints, values: Floats, size: int) -> Floats:
    columns = [np.bincount(where, weights=values[:, j], minlength=size) for j in range(values.shape[1])]
    return np.stack(columns, axis=1) if columns else np.zeros((size, 0))


def _face_means(cage: Cage, data: Floats) -> Floats:
    return np.asarray(np.add.reduceat(data[cage.indices], _starts(cage.counts), axis=0) / cage.counts[:, None])


def _around(edges: Edges, values: Floats, chosen: NDArray[np.bool_], size: int) -> Floats:
    """For each vertex the sum over its chosen edges of the values at their other ends."""
    e = edges.ends[chosen]
    return _sum_at(e[:, 0], values[e[:, 1]], size) + _sum_at(e[:, 1], values[e[:, 0]], size)


def _degree(edges: Edges, chosen: NDArray[np.bool_], size: int) -> Ints:
    return np.bincount(edges.ends[chosen].reshape(-1), minlength=size)


@dataclass(frozen=True)
class _Rules:
    """For each vertex the number of its sharp edges and whether it is a corner, at one sharpness."""

    sharp: NDArray[np.bool_]
    corner: NDArray[np.bool_]
    crease: NDArray[np.bool_]


def _rules(edges: Edges, edge_sharpness: Floats, corner_sharpness: Floats) -> _Rules:
    sharp = edge_sharpness > 0
    degree = _degree(edges, sharp, len(corner_sharpness))
    corner = (corner_sharpness > 0) | (degree > 2)
    return _Rules(sharp, corner, ~corner & (degree == 2))


def _vertex_points(cage: Cage, edges: Edges, face_points: Floats) -> Floats:
    """Where one level moves the vertices."""
    p, size = cage.data, len(cage.data)
    n = np.maximum(_degree(edges, np.ones(len(edges.ends), dtype=bool), size), 1)[:, None].astype(float)
    neighbours = _around(edges, p, np.ones(len(edges.ends), dtype=bool), size)
    face_of_corner = np.repeat(np.arange(len(cage.counts)), cage.counts)
    faces = _sum_at(cage.indices, face_points[face_of_corner], size)
    smooth = p * ((n - 2.0) / n) + (neighbours + faces) / (n * n)

    def under(rules: _Rules) -> Floats:
        crease = 0.75 * p + 0.125 * _around(edges, p, rules.sharp, size)
        out = np.where(rules.crease[:, None], crease, smooth)
        return np.asarray(np.where(rules.corner[:, None], p, out))

    now = _rules(edges, edges.sharpness, cage.corner_sharpness)
    if not (now.corner.any() or now.crease.any()):
        return _keep_unused(cage, smooth)
    child_edges, child_corners = _decayed(edges.sharpness), _decayed(cage.corner_sharpness)
    then = _rules(edges, child_edges, child_corners)
    moved = under(now)
    changes = (now.corner != then.corner) | (now.crease != then.crease)
    if changes.any():
        # The mean sharpness of what becomes smooth in this level says how much of the old rule is left.
        ending = (edges.sharpness > 0) & (child_edges <= 0)
        e = edges.ends[ending]
        weight, count = np.zeros(size), np.zeros(size)
        for column in (0, 1):
            weight += np.bincount(e[:, column], weights=edges.sharpness[ending], minlength=size)
            count += np.bincount(e[:, column], minlength=size)
        corner_ends = (cage.corner_sharpness > 0) & (child_corners <= 0)
        weight += np.where(corner_ends, cage.corner_sharpness, 0.0)
        count += corner_ends
        w = np.minimum(weight / np.maximum(count, 1), 1.0)[:, None]
        mixed = w * moved + (1.0 - w) * under(then)
        moved = np.where((changes & (count > 0))[:, None], mixed, moved)
    return _keep_unused(cage, moved)


def _keep_unused(cage: Cage, moved: Floats) -> Floats:
    used = np.zeros(len(cage.data), dtype=bool)
    used[cage.indices] = True
    return np.asarray(np.where(used[:, None], moved, cage.data))


def step(cage: Cage, smooth: bool = True) -> Cage:
    """One level: a face of n corners becomes n quadrilaterals. ``smooth`` false is bilinear subdivision."""
    edges = _edges(cage)
    p = cage.data
    v, e, f = len(p), len(edges.ends), len(cage.counts)
    face_points = _face_means(cage, p)
    middles = 0.5 * (p[edges.ends[:, 0]] + p[edges.ends[:, 1]])
    if smooth:
        face_of_corner = np.repeat(np.arange(f), cage.counts)
        sums = _sum_at(edges.of_corner, face_points[face_of_corner], e)
        rounded = 0.5 * middles + 0.25 * sums
        share = np.minimum(edges.sharpness, 1.0)[:, None]
        edge_points = np.where(share >= 1.0, middles, share * middles + (1.0 - share) * rounded)
        vertex_points = _vertex_points(cage, edges, face_points)
    else:
        edge_points, vertex_points = middles, p
    previous = np.empty(len(cage.indices), dtype=np.int64)
    previous[_next(cage.counts)] = np.arange(len(cage.indices))
    face_of_corner = np.repeat(np.arange(f), cage.counts)
    quads = np.stack(
        [cage.indices, v + edges.of_corner, v + e + face_of_corner, v + edges.of_corner[previous]], axis=1
    )
    corner = None
    if cage.corner is not None:
        c = cage.corner
        ahead = 0.5 * (c + c[_next(cage.counts)])
        centre = np.add.reduceat(c, _starts(cage.counts), axis=0) / cage.counts[:, None]
        corner = np.stack([c, ahead, centre[face_of_corner], ahead[previous]], axis=1).reshape(-1, c.shape[1])
    return Cage(
        counts=np.full(len(quads), 4),
        indices=quads.reshape(-1),
        data=np.concatenate([vertex_points, edge_points, face_points]),
        crease_edges=np.empty((0, 2), dtype=np.int64),
        crease_sharpness=np.empty(0),
        corner_sharpness=np.concatenate([_decayed(cage.corner_sharpness), np.zeros(e + f)]),
        face=np.repeat(cage.face, cage.counts),
        corner=corner,
        known=_child_edges(cage, edges, previous, face_of_corner),
    )


def _child_edges(cage: Cage, edges: Edges, previous: Ints, face_of_corner: Ints) -> Edges:
    """The edges after a level: two halves of each, and from each edge's point to the points of its faces."""
    v, e, corners = len(cage.data), len(edges.ends), len(cage.indices)
    middle = v + np.arange(e)
    halves = np.stack([edges.ends, np.stack([middle, middle], axis=1)], axis=2).reshape(-1, 2)
    inner = np.stack([v + edges.of_corner, v + e + face_of_corner], axis=1)

    def half(edge: Ints) -> Ints:
        """The half of an edge that ends at the corner's vertex."""
        return np.asarray(2 * edge + (cage.indices == edges.ends[edge, 1]))

    ahead, behind = half(edges.of_corner), half(edges.of_corner[previous])
    across = 2 * e + np.arange(corners)
    return Edges(
        ends=np.concatenate([halves, inner]),
        of_corner=np.stack([ahead, across, across[previous], behind], axis=1).reshape(-1),
        faces=np.concatenate([np.repeat(edges.faces, 2), np.full(corners, 2)]),
        sharpness=np.concatenate([np.repeat(_decayed(edges.sharpness), 2), np.zeros(corners)]),
    )


def limit(cage: Cage) -> Cage:
    """Moves the vertices of a mesh of quadrilaterals to their limits (Halstead, Kass and DeRose 1993; creases: cubic B-splines)."""
    edges = _edges(cage)
    p, size = cage.data, len(cage.data)
    rules = _rules(edges, edges.sharpness, cage.corner_sharpness)
    n = np.maximum(_degree(edges, np.ones(len(edges.ends), dtype=bool), size), 1)[:, None].astype(float)
    neighbours = _around(edges, p, np.ones(len(edges.ends), dtype=bool), size)
    quads = cage.indices.reshape(-1, 4)
    diagonal = _sum_at(quads.reshape(-1), p[np.roll(quads, -2, axis=1)].reshape(-1, p.shape[1]), size)
    smooth = (n * n * p + 4.0 * neighbours + diagonal) / (n * (n + 5.0))
    crease = (4.0 * p + _around(edges, p, rules.sharp, size)) / 6.0
    out = np.where(rules.crease[:, None], crease, smooth)
    out = np.where(rules.corner[:, None], p, out)
    return replace(cage, data=_keep_unused(cage, out))


def sharp_edges(cage: Cage) -> tuple[Ints, NDArray[np.bool_]]:
    """For each corner the edge to the next one, and which edges are still sharp (normals break there)."""
    edges = _edges(cage)
    return edges.of_corner, edges.sharpness > 0


def smooth_normals(cage: Cage, points: NDArray[Any]) -> tuple[Floats, Ints]:
    """Normals of a mesh of quadrilaterals, and for each corner the one that it has.

    Corners that meet at a vertex share a normal if no sharp edge lies between them.
    """
    quads = cage.indices.reshape(-1, 4)
    q = points[quads]
    cross = np.cross(q[:, 2] - q[:, 0], q[:, 3] - q[:, 1])
    of_corner, sharp = sharp_edges(cage)
    sector = _sectors(quads, of_corner, sharp, len(points))
    count = int(sector.max()) + 1 if len(sector) else 0
    normals = _sum_at(sector, np.repeat(cross, 4, axis=0), count)
    length = np.linalg.norm(normals, axis=1, keepdims=True)
    normals = np.where(length > 0, normals / np.maximum(length, 1e-300), [0.0, 0.0, 1.0])
    return normals, sector


def _sectors(quads: Ints, of_corner: Ints, sharp: NDArray[np.bool_], size: int) -> Ints:
    """Numbers the groups of corners around each vertex that smooth edges hold together."""
    indices = quads.reshape(-1)
    if not sharp.any():
        return indices
    at_sharp = np.zeros(size, dtype=bool)
    at_sharp[indices[sharp[of_corner]]] = True
    following = np.arange(len(indices)).reshape(-1, 4)[:, [1, 2, 3, 0]].reshape(-1)
    at_sharp[indices[following][sharp[of_corner]]] = True
    # Two corners meet across a smooth edge: at its start the one corner, at its end the other's next.
    label = np.where(at_sharp[indices], size + np.arange(len(indices)), indices)
    smooth = np.flatnonzero(~sharp[of_corner])
    order = smooth[np.argsort(of_corner[smooth], kind="stable")]
    edge = of_corner[order]
    pair = np.flatnonzero(edge[1:] == edge[:-1])
    a, b = order[pair], order[pair + 1]
    same_way = indices[a] == indices[b]
    ends = [(a, np.where(same_way, b, following[b])), (following[a], np.where(same_way, following[b], b))]
    first, second = (np.concatenate(x) for x in zip(*ends, strict=True))
    touched = at_sharp[indices[first]]
    first, second = first[touched], second[touched]
    while True:
        low = np.minimum(label[first], label[second])
        before = label.copy()
        np.minimum.at(label, first, low)
        np.minimum.at(label, second, low)
        if np.array_equal(before, label):
            break
    return np.asarray(np.unique(label, return_inverse=True)[1].reshape(-1))
