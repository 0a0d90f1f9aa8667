"""Meshes as subdivision sees them, and sums over what meets at their faces, edges and vertices.

Sums take columns: arrays of shape (k, n), so that they run over contiguous memory.
"""

from __future__ import annotations

from dataclasses import dataclass
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
    """The cage that this one is the next level of, by Catmull and Clark: then the creases are in its edges."""
    known: Edges | None = None
    """The edges, if they are known: then the creases are in them."""

    @cached_property
    def edges(self) -> Edges:
        if self.known is not None:
            return self.known
        return _child_edges(self.before) if self.before is not None else _find_edges(self)

    @property
    def columns(self) -> Floats:
        """The data, (k, v)."""
        return np.ascontiguousarray(self.data.T)


def _starts(counts: Ints) -> Ints:
    return np.asarray(np.cumsum(counts) - counts)


def _sides(counts: Ints) -> int | None:
    """The number of corners that all faces have."""
    return int(counts[0]) if len(counts) and counts.min() == counts.max() else None


def by_face(values: NDArray[Any], n: int) -> NDArray[Any]:
    """Values (..., corners) of faces of n corners as (..., faces, n)."""
    return values.reshape(*values.shape[:-1], values.shape[-1] // n, n)


def following(counts: Ints) -> Ints:
    """Position of the next corner of the same face."""
    out = np.arange(1, counts.sum() + 1)
    out[np.cumsum(counts) - 1] = _starts(counts)
    return out


def ahead_of(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """For each corner the value of the next one of its face; values are (..., corners)."""
    n = _sides(counts)
    if n is None:
        return values[..., following(counts)]
    return np.roll(by_face(values, n), -1, axis=-1).reshape(values.shape)


def behind(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """The same of the corner before."""
    n = _sides(counts)
    if n is None:
        previous = np.empty(values.shape[-1], dtype=np.int64)
        previous[following(counts)] = np.arange(len(previous))
        return values[..., previous]
    return np.roll(by_face(values, n), 1, axis=-1).reshape(values.shape)


def of_faces(counts: Ints, values: NDArray[Any]) -> NDArray[Any]:
    """For each corner the value of its face."""
    n = _sides(counts)
    return np.asarray(np.repeat(values, counts if n is None else n, axis=-1))


def face_sums(counts: Ints, values: Floats) -> Floats:
    """Sums of (k, corners) values over the corners of faces."""
    n = _sides(counts)
    if n != 4:
        return np.asarray(np.add.reduceat(values, _starts(counts), axis=-1))
    q = by_face(values, 4)
    return np.asarray(q[..., 0] + ((q[..., 1] + q[..., 2]) + q[..., 3]))


def sum_at(where: Ints, values: Floats, size: int) -> Floats:
    """Sums of the values (k, n) that go to each of ``size`` places."""
    out = np.empty((len(values), size))
    for column, weights in zip(out, values, strict=True):
        column[:] = np.bincount(where, weights=weights, minlength=size)
    return out


def _find_edges(cage: Cage) -> Edges:
    """Edges in the order of their ends, by sorting."""
    a, b = cage.indices, ahead_of(cage.counts, cage.indices)
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


def halved(edges: Edges, v: int) -> Ints:
    """Ends of both halves of each edge, the one at its first end first; the middles follow v vertices."""
    return np.stack([edges.ends.reshape(-1), np.repeat(v + np.arange(len(edges.ends)), 2)], axis=1)


def half_at(edges: Edges, edge: Ints, vertex: Ints) -> Ints:
    """The half of an edge that ends at a vertex."""
    return np.asarray(2 * edge + (vertex == edges.ends[edge, 1]))


def _child_edges(cage: Cage) -> Edges:
    """The edges after a level: two halves of each, and from each edge's point to the points of its faces."""
    edges = cage.edges
    v, e, corners = len(cage.data), len(edges.ends), len(cage.indices)
    halves = halved(edges, v)
    inner = np.stack([v + edges.of_corner, v + e + of_faces(cage.counts, np.arange(len(cage.counts)))], axis=1)

    across = 2 * e + np.arange(corners)
    before = behind(cage.counts, edges.of_corner)
    sides = [half_at(edges, edges.of_corner, cage.indices), across, behind(cage.counts, across), half_at(edges, before, cage.indices)]
    return Edges(
        ends=np.concatenate([halves, inner]),
        of_corner=np.stack(sides, axis=1).reshape(-1),
        faces=np.concatenate([np.repeat(edges.faces, 2), np.full(corners, 2)]),
        sharpness=np.concatenate([np.repeat(decayed(edges.sharpness), 2), np.zeros(corners)]),
    )


def sharp_edges(cage: Cage) -> tuple[Ints, Bools]:
    """For each corner the edge to the next one, and which edges are sharp."""
    return cage.edges.of_corner, cage.edges.sharpness > 0


def decayed(sharpness: Floats) -> Floats:
    return np.where(sharpness >= INFINITE, INFINITE, np.maximum(sharpness - 1.0, 0.0))
