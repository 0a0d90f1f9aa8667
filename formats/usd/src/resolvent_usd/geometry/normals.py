"""Normals of subdivision surfaces, which break at sharp edges."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .cage import Cage, Floats, Ints, behind, decayed, face_sums, following, of_faces, sum_at


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
    cross = _cross(of_faces(counts, p[:, v + e :]) - p[:, old.indices], behind(counts, at_edge) - at_edge)
    before = behind(counts, edges.of_corner)
    sums = np.concatenate(
        [sum_at(old.indices, cross, v), sum_at(edges.of_corner, cross, e) + sum_at(before, cross, e), face_sums(counts, cross)], axis=1
    )
    which, corner, sector = _sectors(cage)
    if len(corner):
        count = max(sums.shape[1], int(sector.max()) + 1)
        sums = np.concatenate([sums, np.zeros((3, count - sums.shape[1]))], axis=1)
        numbers, place = np.unique(sector, return_inverse=True)
        sums[:, numbers] = sum_at(place, cross[:, corner // 4], len(numbers))
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
    sharp = decayed(edges.sharpness) > 0
    if not sharp.any():
        return cage.indices, np.empty(0, dtype=np.int64), np.empty(0, dtype=np.int64)
    # At an old vertex: corners of the old faces, of which two hang together if a smooth edge is between them.
    touched = np.zeros(v, dtype=bool)
    touched[edges.ends[sharp].reshape(-1)] = True
    here = np.flatnonzero(touched[old.indices])
    vertex = old.indices[here]
    before = behind(counts, edges.of_corner)
    edge = np.concatenate([edges.of_corner[here], before[here]])
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
        last = label.copy()
        np.minimum.at(label, a, low)
        np.minimum.at(label, b, low)
        if np.array_equal(last, label):
            return label
