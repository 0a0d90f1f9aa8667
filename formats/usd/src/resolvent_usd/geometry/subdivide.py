"""Catmull–Clark subdivision with creases, corners, boundaries and holes, whole levels at a time.

The rules are OpenSubdiv's, which USD's schema refers to: Catmull and Clark 1978 for smooth vertices, DeRose, Kass and Truong
1998 ("Subdivision surfaces in character animation") for semi-sharp creases, whose sharpness falls by one per level. After the
last level, vertices are moved to their limits, so that they lie on the surface itself.

A level makes of v vertices, e edges and f faces one vertex each, in this order, and of each corner a quadrilateral: the vertex
itself, the point of the edge to the next corner, that of the face, that of the edge before. Sums over neighbours follow from that
and need no search. Within this module, data are columns: arrays of shape (k, v), so that sums run over contiguous memory.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

Ints = NDArray[np.int64]
Floats = NDArray[np.float64]
Bools = NDArray[np.bool_]

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
    before: Cage | None = None
    """The cage that this one is the next level of: then the creases are in its edges."""

    @cached_property
    def edges(self) -> Edges:
        return _child_edges(self.before) if self.before is not None else _find_edges(self)

    @property
    def columns(self) -> Floats:
        """The data, (k, v)."""
        return np.ascontiguousarray(self.data.T)

    def with_data(self, data: Floats) -> Cage:
        """The same mesh with other values; edges that are known stay known."""
        other = replace(self, data=data)
        if "edges" in self.__dict__:
            other.__dict__["edges"] = self.edges
        return other


def _starts(counts: Ints) -> Ints:
    return np.asarray(np.cumsum(counts) - counts)


def _sides(counts: Ints) -> int | None:
    """The number of corners that all faces have."""
    return int(counts[0]) if len(counts) and counts.min() == counts.max() else None


def _by_face(values: NDArray[Any], n: int) -> NDArray[Any]:
    """Values (..., corners) of faces of n corners as (..., faces, n)."""
    return values.reshape(*values.shape[:-1], values.shape[-1] // n, n)


def following(counts: Ints) -> Ints:
    """Position of the next corner of the same face."""
    out = np.arange(1, counts.sum() + 1)
    out[np.cumsum(counts) - 1] = _starts(counts)
    return out


def _ahead(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """For each corner the value of the next one of its face; values are (..., corners)."""
    n = _sides(counts)
    if n is None:
        return values[..., following(counts)]
    return np.roll(_by_face(values, n), -1, axis=-1).reshape(values.shape)


def _behind(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """The same of the corner before."""
    n = _sides(counts)
    if n is None:
        previous = np.empty(values.shape[-1], dtype=np.int64)
        previous[following(counts)] = np.arange(len(previous))
        return values[..., previous]
    return np.roll(_by_face(values, n), 1, axis=-1).reshape(values.shape)


def _of_faces(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """For each corner the value of its face."""
    n = _sides(counts)
    return np.asarray(np.repeat(values, counts if n is None else n, axis=-1))


def _face_sums(counts: Ints, values: Floats) -> Floats:
    """Sums of (k, corners) values over the corners of faces."""
    n = _sides(counts)
    if n != 4:
        return np.asarray(np.add.reduceat(values, _starts(counts), axis=-1))
    q = _by_face(values, 4)
    return np.asarray(q[..., 0] + ((q[..., 1] + q[..., 2]) + q[..., 3]))


def _sum_at(where: Ints, values: Floats, size: int) -> Floats:
    """Sums of the values (k, n) that go to each of ``size`` places."""
    out = np.empty((len(values), size))
    for column, weights in zip(out, values, strict=True):
        column[:] = np.bincount(where, weights=weights, minlength=size)
    return out


def _find_edges(cage: Cage) -> Edges:
    """Edges in the order of their ends, by sorting."""
    a, b = cage.indices, _ahead(cage.counts, cage.indices)
    low, high = np.minimum(a, b), np.maximum(a, b)
    bits, place = int(len(cage.data)).bit_length(), int(len(a)).bit_length()
    if 2 * bits + place < 64:
        # Both ends and the corner in one number: sorting numbers is several times faster than sorting their places.
        packed = np.sort((low << (bits + place)) | (high << place) | np.arange(len(a)))
        order, key = packed & ((1 << place) - 1), packed >> place
    else:
        key = (low << bits) | high
        order = np.argsort(key)
        key = key[order]
    new = np.ones(len(key), dtype=bool)
    np.not_equal(key[1:], key[:-1], out=new[1:])
    of_corner = np.empty(len(key), dtype=np.int64)
    of_corner[order] = np.cumsum(new) - 1
    first = np.flatnonzero(new)
    keys, faces = key[first], np.diff(first, append=len(key))
    sharpness = np.zeros(len(keys))
    if len(cage.crease_edges):
        c = np.sort(cage.crease_edges, axis=1)
        wanted = (c[:, 0] << bits) | c[:, 1]
        at = np.minimum(np.searchsorted(keys, wanted), len(keys) - 1)
        found = keys[at] == wanted
        np.maximum.at(sharpness, at[found], cage.crease_sharpness[found])
    # Boundaries are creases; so is what more than two faces share.
    sharpness[faces != 2] = INFINITE
    return Edges(np.stack([keys >> bits, keys & ((1 << bits) - 1)], axis=1), of_corner, faces, sharpness)


def _child_edges(cage: Cage) -> Edges:
    """The edges after a level: two halves of each, and from each edge's point to the points of its faces."""
    edges = cage.edges
    v, e, corners = len(cage.data), len(edges.ends), len(cage.indices)
    halves = np.stack([edges.ends.reshape(-1), np.repeat(v + np.arange(e), 2)], axis=1)
    inner = np.stack([v + edges.of_corner, v + e + _of_faces(cage.counts, np.arange(len(cage.counts)))], axis=1)

    def half(edge: Ints) -> Ints:
        """The half of an edge that ends at the corner's vertex."""
        return np.asarray(2 * edge + (cage.indices == edges.ends[edge, 1]))

    across = 2 * e + np.arange(corners)
    sides = [half(edges.of_corner), across, _behind(cage.counts, across), half(_behind(cage.counts, edges.of_corner))]
    return Edges(
        ends=np.concatenate([halves, inner]),
        of_corner=np.stack(sides, axis=1).reshape(-1),
        faces=np.concatenate([np.repeat(edges.faces, 2), np.full(corners, 2)]),
        sharpness=np.concatenate([np.repeat(_decayed(edges.sharpness), 2), np.zeros(corners)]),
    )


def sharp_edges(cage: Cage) -> tuple[Ints, Bools]:
    """For each corner the edge to the next one, and which edges are sharp."""
    return cage.edges.of_corner, cage.edges.sharpness > 0


def _decayed(sharpness: Floats) -> Floats:
    return np.where(sharpness >= INFINITE, INFINITE, np.maximum(sharpness - 1.0, 0.0))


@dataclass(frozen=True)
class _Rules:
    """Vertices that are not smooth, at one sharpness of edges and corners."""

    sharp: Bools
    """Of edges."""
    corner: Bools
    crease: Bools

    @staticmethod
    def of(edges: Edges, edge_sharpness: Floats, corner_sharpness: Floats) -> _Rules:
        sharp = edge_sharpness > 0
        degree = np.bincount(edges.ends[sharp].reshape(-1), minlength=len(corner_sharpness))
        corner = (corner_sharpness > 0) | (degree > 2)
        return _Rules(sharp, corner, ~corner & (degree == 2))

    @property
    def special(self) -> bool:
        return bool(self.corner.any() or self.crease.any())


def _around_sharp(edges: Edges, sharp: Bools, p: Floats) -> Floats:
    """For each vertex the sum of the other ends of its sharp edges."""
    e = edges.ends[sharp]
    return _sum_at(e[:, 0], p[:, e[:, 1]], p.shape[1]) + _sum_at(e[:, 1], p[:, e[:, 0]], p.shape[1])


def _vertex_points(cage: Cage, p: Floats, face_values: Floats) -> Floats:
    """Where one level moves the vertices; ``face_values`` are the faces' points, at their corners."""
    edges, size = cage.edges, p.shape[1]
    a, b = edges.ends.T.copy()
    degree = np.bincount(a, minlength=size) + np.bincount(b, minlength=size)
    n = np.maximum(degree, 1).astype(float)
    neighbours = _sum_at(a, p[:, b], size) + _sum_at(b, p[:, a], size)
    smooth: Floats = p * ((n - 2.0) / n) + (neighbours + _sum_at(cage.indices, face_values, size)) / (n * n)

    def under(rules: _Rules) -> Floats:
        if not rules.special:
            return smooth
        crease = 0.75 * p + 0.125 * _around_sharp(edges, rules.sharp, p)
        return np.asarray(np.where(rules.corner, p, np.where(rules.crease, crease, smooth)))

    now = _Rules.of(edges, edges.sharpness, cage.corner_sharpness)
    moved = under(now)
    if now.special:
        child_edges, child_corners = _decayed(edges.sharpness), _decayed(cage.corner_sharpness)
        then = _Rules.of(edges, child_edges, child_corners)
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
            w = np.minimum(weight / np.maximum(count, 1), 1.0)
            moved = np.where(changes & (count > 0), w * moved + (1.0 - w) * under(then), moved)
    # What no face uses stays where it is.
    return np.asarray(np.where(degree > 0, moved, p)) if (degree == 0).any() else moved


def step(cage: Cage, smooth: bool = True) -> Cage:
    """One level: a face of n corners becomes n quadrilaterals. ``smooth`` false is bilinear subdivision."""
    edges, counts, p = cage.edges, cage.counts, cage.columns
    v, e, f = p.shape[1], len(edges.ends), len(counts)
    face_points = _face_sums(counts, p[:, cage.indices]) / counts
    edge_points = 0.5 * (p[:, edges.ends[:, 0]] + p[:, edges.ends[:, 1]])
    vertex_points = p
    if smooth:
        face_values = _of_faces(counts, face_points)
        rounded = 0.5 * edge_points + 0.25 * _sum_at(edges.of_corner, face_values, e)
        at = np.flatnonzero(edges.sharpness > 0.0)
        share = np.minimum(edges.sharpness[at], 1.0)
        rounded[:, at] = np.where(share >= 1.0, edge_points[:, at], share * edge_points[:, at] + (1.0 - share) * rounded[:, at])
        edge_points = rounded
        vertex_points = _vertex_points(cage, p, face_values)
    quads = np.empty((len(cage.indices), 4), dtype=np.int64)
    quads[:, 0] = cage.indices
    quads[:, 1] = v + edges.of_corner
    quads[:, 2] = _of_faces(counts, v + e + np.arange(f))
    quads[:, 3] = _behind(counts, quads[:, 1])
    return Cage(
        counts=np.full(len(quads), 4),
        indices=quads.reshape(-1),
        data=np.concatenate([vertex_points, edge_points, face_points], axis=1).T,
        crease_edges=np.empty((0, 2), dtype=np.int64),
        crease_sharpness=np.empty(0),
        corner_sharpness=np.concatenate([_decayed(cage.corner_sharpness), np.zeros(e + f)]),
        face=_of_faces(counts, cage.face),
        before=cage,
    )


def linear(counts: Ints, values: Floats) -> Floats:
    """One level of values (k, corners) that are interpolated linearly within each face: those of the quadrilaterals' corners."""
    ahead = 0.5 * (values + _ahead(counts, values))
    centre = _of_faces(counts, _face_sums(counts, values) / counts)
    return np.stack([values, ahead, centre, _behind(counts, ahead)], axis=-1).reshape(len(values), -1)


def limit(cage: Cage) -> Cage:
    """Moves the vertices of a mesh after a level to their limits (Halstead, Kass and DeRose 1993; creases: cubic B-splines)."""
    old = cage.before
    assert old is not None, "limits are known after a level"
    edges, counts, p = old.edges, old.counts, cage.columns
    v, e, f = len(old.data), len(edges.ends), len(counts)
    a, b = edges.ends.T.copy()
    of_vertices, of_edges, of_faces = p[:, :v], p[:, v : v + e], p[:, v + e :]
    at_edge = of_edges[:, edges.of_corner]
    at_face = _of_faces(counts, of_faces)
    behind = _behind(counts, edges.of_corner)
    out = np.empty_like(p)

    def smooth(part: slice, degree: Ints, neighbours: Floats, across: Floats) -> None:
        """Points with so many neighbours, the sum of these, and that of what lies across the quadrilaterals."""
        n = np.maximum(degree, 1).astype(float)
        here = np.multiply(n * n, p[:, part], out=out[:, part])
        here += np.multiply(neighbours, 4.0, out=neighbours)
        here += across
        here /= n * (n + 5.0)

    degree = np.bincount(a, minlength=v) + np.bincount(b, minlength=v)
    smooth(slice(0, v), degree, _sum_at(a, of_edges, v) + _sum_at(b, of_edges, v), _sum_at(old.indices, at_face, v))
    if (unused := np.flatnonzero(degree == 0)).size:
        out[:, unused] = p[:, unused]
    beside = _sum_at(edges.of_corner, at_face, e) + (of_vertices[:, a] + of_vertices[:, b])
    across = _sum_at(edges.of_corner, _behind(counts, at_edge), e) + _sum_at(behind, at_edge, e)
    smooth(slice(v, v + e), 2 + edges.faces, beside, across)
    smooth(slice(v + e, v + e + f), counts, _face_sums(counts, at_edge), _face_sums(counts, of_vertices[:, old.indices]))
    # Sharp halves of edges, and the corners, as the rules of the last level have them.
    sharp = np.flatnonzero(_decayed(edges.sharpness) > 0)
    sharp_degree = np.bincount(edges.ends[sharp].reshape(-1), minlength=v)
    fixed = (cage.corner_sharpness[:v] > 0) | (sharp_degree > 2)
    crease = np.flatnonzero(~fixed & (sharp_degree == 2))
    along = _sum_at(a[sharp], of_edges[:, sharp], v) + _sum_at(b[sharp], of_edges[:, sharp], v)
    out[:, crease] = (4.0 * p[:, crease] + along[:, crease]) / 6.0
    out[:, v + sharp] = (4.0 * of_edges[:, sharp] + (of_vertices[:, a[sharp]] + of_vertices[:, b[sharp]])) / 6.0
    at = np.flatnonzero(fixed)
    out[:, at] = p[:, at]
    return replace(cage, data=out.T)


def smooth_normals(cage: Cage, points: NDArray[Any]) -> tuple[Floats, Ints]:
    """Normals of a mesh after a level, and for each corner the one that it has.

    Corners that meet at a vertex share a normal if no sharp edge lies between them; where all do, it has the vertex' number.
    """
    old = cage.before
    assert old is not None, "corners are known after a level"
    edges, counts = old.edges, old.counts
    v, e = len(old.data), len(edges.ends)
    p = np.ascontiguousarray(np.asarray(points, dtype=float).T)
    at_edge = p[:, v + edges.of_corner]
    cross = _cross(_of_faces(counts, p[:, v + e :]) - p[:, old.indices], _behind(counts, at_edge) - at_edge)
    behind = _behind(counts, edges.of_corner)
    sums = np.concatenate(
        [_sum_at(old.indices, cross, v), _sum_at(edges.of_corner, cross, e) + _sum_at(behind, cross, e), _face_sums(counts, cross)], axis=1
    )
    which, corner, sector = _sectors(cage)
    if len(corner):
        count = max(sums.shape[1], int(sector.max()) + 1)
        sums = np.concatenate([sums, np.zeros((3, count - sums.shape[1]))], axis=1)
        numbers, place = np.unique(sector, return_inverse=True)
        sums[:, numbers] = _sum_at(place, cross[:, corner // 4], len(numbers))
    length = np.sqrt((sums[0] * sums[0] + sums[1] * sums[1]) + sums[2] * sums[2])
    with np.errstate(invalid="ignore", divide="ignore"):
        sums /= length
    sums[:, length == 0.0] = np.array([[0.0], [0.0], [1.0]])
    return sums.T, which


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _sectors(cage: Cage) -> tuple[Ints, Ints, Ints]:
    """For each corner the group of those that smooth edges hold together around a vertex; and the corners at sharp edges with theirs.

    The first group of a vertex has its number, others have those after the last vertex.
    """
    old = cage.before
    assert old is not None
    edges, counts, size = old.edges, old.counts, len(cage.data)
    v = len(old.data)
    sharp = _decayed(edges.sharpness) > 0
    if not sharp.any():
        return cage.indices, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    # At an old vertex: corners of the old faces, of which two hang together if a smooth edge is between them.
    touched = np.zeros(v, dtype=bool)
    touched[edges.ends[sharp].reshape(-1)] = True
    here = np.flatnonzero(touched[old.indices])
    vertex = old.indices[here]
    behind = _behind(counts, edges.of_corner)
    edge = np.concatenate([edges.of_corner[here], behind[here]])
    meets = 2 * edge + (np.concatenate([vertex, vertex]) == edges.ends[edge, 1])
    member = np.concatenate([np.arange(len(here))] * 2)
    order = np.argsort(meets, kind="stable")
    order = order[~sharp[edge[order]]]
    pair = np.flatnonzero(meets[order[1:]] == meets[order[:-1]])
    label = _joined(len(here), member[order[pair]], member[order[pair + 1]])
    # At the middle of a sharp edge: the faces beside it, of two corners each.
    middle = np.flatnonzero(sharp[edges.of_corner])
    ahead = following(counts)[middle]
    corner = np.concatenate([4 * here, 4 * middle + 1, 4 * ahead + 3])
    at = np.concatenate([vertex, v + edges.of_corner[middle], v + edges.of_corner[middle]])
    group = np.concatenate([here[label], middle, middle])
    # Groups in the order of their vertices and first corners; the first of each vertex has its number.
    known, of = np.unique(at * len(old.indices) + group, return_inverse=True)
    owner = known // len(old.indices)
    first = np.ones(len(known), dtype=bool)
    np.not_equal(owner[1:], owner[:-1], out=first[1:])
    number = np.where(first, owner, size - 1 + np.cumsum(~first))
    sector = number[of.reshape(-1)]
    if first.all():
        return cage.indices, corner, sector
    which = cage.indices.copy()
    which[corner] = sector
    return which, corner, sector


def _joined(count: int, a: Ints, b: Ints) -> Ints:
    """Numbers things 0..count by the smallest one that pairs (a, b) join each to."""
    label = np.arange(count)
    while True:
        low = np.minimum(label[a], label[b])
        before = label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        if np.array_equal(before, label):
            return label
