"""Corners of polygons to vertices: those that agree in everything become one."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from .glb import Triangles, compact
from .primvars import Topology

Array = NDArray[Any]
Ints = NDArray[np.int64]


def welded(
    points: Array,
    indices: Ints,
    corners: Ints,
    normals: tuple[Array, Ints] | None,
    uv: tuple[Array, Ints] | None,
    colors: tuple[Array, Ints] | None,
) -> Triangles:
    """Corners of a point that have in everything what its first corner has become one vertex with it."""
    attributes = (normals, uv, colors)
    apart = [a for a in attributes if a is not None and a[1] is not indices]
    if apart:
        first = _first_corners(indices, len(points))
        shared = _shared(apart, indices, first)
        if shared is not None:
            source, vertex = shared
            if len(source) == len(indices):
                return compact(Triangles(points.take(indices, axis=0), corners, *map(_whole, attributes)))
            place = points.take(indices.take(source), axis=0)
            return compact(Triangles(place, vertex.take(corners), *(_taken(a, source) for a in attributes)))

    # Everything hangs on the point.
    def per_point(a: tuple[Array, Ints] | None) -> Array | None:
        if a is None or a[1] is indices:
            return None if a is None else a[0]
        return a[0].take(a[1].take(first), axis=0)

    return compact(Triangles(points, indices.take(corners), *(per_point(a) for a in attributes)))


def _taken(a: tuple[Array, Ints] | None, corners: Ints) -> Array | None:
    """The values at some corners."""
    return None if a is None else a[0].take(a[1].take(corners), axis=0)


def _whole(a: tuple[Array, Ints] | None) -> Array | None:
    """The values at all corners."""
    if a is None or _one_each(a[1]):
        return None if a is None else a[0]
    return a[0].take(a[1], axis=0)


def _first_corners(indices: Ints, size: int) -> Ints:
    """For each point its first corner (0 for those without)."""
    first = np.zeros(size, dtype=np.int64)
    first[indices[::-1]] = np.arange(len(indices) - 1, -1, -1)
    return first


def _shared(attributes: list[tuple[Array, Ints]], indices: Ints, first: Ints) -> tuple[Ints, Ints] | None:
    """Vertices, in the order of their first corners: those corners, and for each corner its vertex. None if points are enough."""
    leader = first.take(indices)
    different = [_differ(values, which, which.take(leader)) for values, which in attributes]
    own = np.logical_or.reduce(different)
    if not own.any():
        return None
    alone = np.zeros(len(indices), dtype=bool)
    for (_, which), differs in zip(attributes, different, strict=True):
        if _one_each(which):
            alone |= differs
    leads = leader.copy()
    leads[own] = np.flatnonzero(own)
    # Others that differ from the first may be alike: where all that they have was given to several corners by one number.
    if len(rest := np.flatnonzero(own & ~alone)):
        key = indices[rest]
        for (_, which), differs in zip(attributes, different, strict=True):
            numbers = np.where(differs[rest], which[rest], which[leader[rest]])
            key = np.unique(key, return_inverse=True)[1] * (int(which.max()) + 1) + numbers
        _, least, group = np.unique(key, return_index=True, return_inverse=True)
        leads[rest] = rest[least][group]
    return _numbered(leads)


def _numbered(leads: Ints) -> tuple[Ints, Ints]:
    """Of corners that each have a leading one: those that lead, and for each corner the number of its own."""
    leading = np.zeros(len(leads), dtype=bool)
    leading[leads] = True
    return np.flatnonzero(leading), (np.cumsum(leading) - 1).take(leads)


def _one_each(which: Ints) -> bool:
    """True if every corner has a value of its own."""
    return len(which) > 0 and int(which[-1]) == len(which) - 1 and np.array_equal(which, np.arange(len(which)))


def _differ(values: Array, a: Ints, b: Ints) -> NDArray[np.bool_]:
    """True where rows a and b of the values differ."""
    out: NDArray[np.bool_] = a != b
    at = np.flatnonzero(out)
    other = values.take(a.take(at), axis=0) != values.take(b.take(at), axis=0)
    out[at] = other[:, 0] if other.shape[1] == 1 else np.logical_or.reduce(list(other.T))
    return out


def welds(topology: Topology, values: Array) -> tuple[Ints, Ints]:
    """Corners of a point with equal values are one: the first corners, and for each corner the number of its own."""
    indices = topology.indices
    leads, rest = np.arange(len(indices)), np.arange(len(indices))
    # Most have what the first one has, or the first of those that have not.
    for _ in range(8):
        here = indices.take(rest)
        leader = rest.take(_first_corners(here, topology.points).take(here))
        differs = _differ(values, rest, leader)
        leads[rest] = leader
        rest = rest[differs]
        if len(rest) == 0:
            break
    else:
        rest = rest[np.lexsort((*values[rest].T, indices[rest]))]
        new = np.ones(len(rest), dtype=bool)
        new[1:] = _differ(values, rest[1:], rest[:-1]) | (indices[rest[1:]] != indices[rest[:-1]])
        leads[rest] = rest[new][np.cumsum(new) - 1]
    return _numbered(leads)
