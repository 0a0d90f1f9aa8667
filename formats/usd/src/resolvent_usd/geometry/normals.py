"""Normals of subdivision surfaces, which break at sharp edges."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cage import Bools, Cage, Floats, Ints, behind, decayed, face_sums, following, half_at, of_faces, sum_at


def smooth_normals(cage: Cage, points: NDArray[Any]) -> tuple[Floats, Ints]:
    """Normals of a mesh after a level, and for each corner the one that it has.

    Corners that meet at a vertex share a normal if no sharp edge lies between them; where all do, it has the vertex' number.
    """
    p = np.ascontiguousarray(np.asarray(points, dtype=float).T)
    old = cage.before
    if old is None:
        return _of_triangles(cage, p)
    edges, counts = old.edges, old.counts
    v, e = len(old.data), len(edges.ends)
    at_edge = p[:, v + edges.of_corner]
    cross = _cross(of_faces(counts, p[:, v + e :]) - p[:, old.indices], behind(counts, at_edge) - at_edge)
    before = behind(counts, edges.of_corner)
    sums = np.concatenate(
        [sum_at(old.indices, cross, v), sum_at(edges.of_corner, cross, e) + sum_at(before, cross, e), face_sums(counts, cross)], axis=1
    )
    which, corner, sector = _sectors(cage, old)
    return _unit(_apart(sums, sector, cross[:, corner // 4])), which


def _of_triangles(cage: Cage, p: Floats) -> tuple[Floats, Ints]:
    """The same of any mesh of triangles."""
    a, b, c = (p[:, cage.indices[k::3]] for k in range(3))
    cross = _cross(b - a, c - a)
    sharp = cage.edges.sharpness > 0
    sums = sum_at(cage.indices, of_faces(cage.counts, cross), p.shape[1])
    if not sharp.any():
        return _unit(sums), cage.indices
    here, group = _around_vertices(cage, sharp)
    which, sector = _numbered(cage, here, cage.indices[here], group)
    return _unit(_apart(sums, sector, cross[:, here // 3])), which


def _apart(sums: Floats, sector: Ints, cross: Floats) -> Floats:
    """Sums with those of the groups at sharp edges: of each corner there the group and what it adds."""
    if len(sector) == 0:
        return sums
    count = max(sums.shape[1], int(sector.max()) + 1)
    sums = np.concatenate([sums, np.zeros((3, count - sums.shape[1]))], axis=1)
    numbers, place = np.unique(sector, return_inverse=True)
    sums[:, numbers] = sum_at(place, cross, len(numbers))
    return sums


def _unit(sums: Floats) -> Floats:
    """Vectors (n, 3) of length 1."""
    length = np.sqrt((sums[0] * sums[0] + sums[1] * sums[1]) + sums[2] * sums[2])
    with np.errstate(invalid="ignore", divide="ignore"):
        sums /= length
    sums[:, length == 0.0] = np.array([[0.0], [0.0], [1.0]])
    return sums.T


def _cross(a: Floats, b: Floats) -> Floats:
    return np.stack([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])


def _sectors(cage: Cage, old: Cage) -> tuple[Ints, Ints, Ints]:
    """For each corner its normal; and the corners at sharp edges with theirs."""
    edges = old.edges
    sharp = decayed(edges.sharpness) > 0
    if not sharp.any():
        return cage.indices, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    # At an old vertex as on the old mesh; at the middle of a sharp edge the faces beside it, of two corners each.
    here, group = _around_vertices(old, sharp)
    middle = np.flatnonzero(sharp[edges.of_corner])
    ahead = following(old.counts)[middle]
    corner = np.concatenate([4 * here, 4 * middle + 1, 4 * ahead + 3])
    at = len(old.data) + edges.of_corner[middle]
    which, sector = _numbered(cage, corner, np.concatenate([old.indices[here], at, at]), np.concatenate([group, middle, middle]))
    return which, corner, sector


def _around_vertices(cage: Cage, sharp: Bools) -> tuple[Ints, Ints]:
    """Corners at the ends of sharp edges, and of each the first one that smooth edges hold it together with."""
    edges = cage.edges
    touched = np.zeros(len(cage.data), dtype=bool)
    touched[edges.ends[sharp].reshape(-1)] = True
    here = np.flatnonzero(touched[cage.indices])
    vertex = cage.indices[here]
    edge = np.concatenate([edges.of_corner[here], behind(cage.counts, edges.of_corner)[here]])
    meets = half_at(edges, edge, np.concatenate([vertex, vertex]))
    member = np.concatenate([np.arange(len(here))] * 2)
    order = np.argsort(meets, kind="stable")
    order = order[~sharp[edge[order]]]
    pair = np.flatnonzero(meets[order[1:]] == meets[order[:-1]])
    return here, here[_joined(len(here), member[order[pair]], member[order[pair + 1]])]


def _numbered(cage: Cage, corner: Ints, vertex: Ints, group: Ints) -> tuple[Ints, Ints]:
    """Numbers of normals for all corners, and for these, which are of groups at vertices.

    The first group of a vertex has its number, others have those after the last vertex.
    """
    total = len(cage.indices)
    known, of = np.unique(vertex * total + group, return_inverse=True)
    owner = known // total
    first = np.ones(len(known), dtype=bool)
    np.not_equal(owner[1:], owner[:-1], out=first[1:])
    sector = np.where(first, owner, len(cage.data) - 1 + np.cumsum(~first))[of]
    if first.all():
        return cage.indices, sector
    which = cage.indices.copy()
    which[corner] = sector
    return which, sector


def _joined(count: int, a: Ints, b: Ints) -> Ints:
    """Numbers things 0..count by the smallest one that pairs (a, b) join each to."""
    label = np.arange(count)
    while True:
        low = np.minimum(label[a], label[b])
        last = label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        if np.array_equal(last, label):
            return label
