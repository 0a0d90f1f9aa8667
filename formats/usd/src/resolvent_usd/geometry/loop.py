"""Loop subdivision of triangles, with creases, corners and boundaries as in :mod:`subdivide`.

Loop 1987 ("Smooth subdivision surfaces based on triangles") with his weights, as OpenSubdiv has them. A level makes of v vertices and
e edges one vertex each, in this order, and of each triangle four: one at each corner, and the one in the middle.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import creases
from .cage import Cage, Edges, Floats, Ints, ahead_of, behind, decayed, half_at, halved, of_faces, sum_at


def _weights(degree: Ints) -> Floats:
    """Of each neighbour of a smooth vertex with so many of them."""
    n = np.maximum(degree, 1).astype(float)
    return np.asarray((0.625 - (0.375 + 0.25 * np.cos(2.0 * np.pi / n)) ** 2) / n)


def _neighbours(edges: Edges, p: Floats) -> tuple[Floats, Ints]:
    """Sums of the vertices' neighbours, and how many there are."""
    a, b = edges.ends.T.copy()
    v = p.shape[1]
    return sum_at(a, p[:, b], v) + sum_at(b, p[:, a], v), np.bincount(a, minlength=v) + np.bincount(b, minlength=v)


def step(cage: Cage) -> Cage:
    """One level: a triangle becomes four."""
    edges, counts, p = cage.edges, cage.counts, cage.columns
    v, e, f = p.shape[1], len(edges.ends), len(counts)
    ends = p[:, edges.ends[:, 0]] + p[:, edges.ends[:, 1]]
    opposite = sum_at(edges.of_corner, p[:, behind(counts, cage.indices)], e)
    beside = creases.edge_points(edges, 0.5 * ends, 0.375 * ends + 0.125 * opposite)
    neighbours, degree = _neighbours(edges, p)
    weight = _weights(degree)
    moved = creases.vertex_points(cage, p, (1.0 - degree * weight) * p + weight * neighbours, degree)
    middle, across = v + edges.of_corner, 2 * e + np.arange(3 * f)
    before = behind(counts, edges.of_corner)
    # Corner by corner the triangle that it keeps, and the one in the middle.
    corners = np.empty((f, 4, 3), dtype=np.int64)
    corners[:, :3] = np.stack([cage.indices, middle, v + before], axis=1).reshape(f, 3, 3)
    corners[:, 3] = middle.reshape(f, 3)
    sides = np.empty((f, 4, 3), dtype=np.int64)
    own = [half_at(edges, edges.of_corner, cage.indices), across, half_at(edges, before, cage.indices)]
    sides[:, :3] = np.stack(own, axis=1).reshape(f, 3, 3)
    sides[:, 3] = ahead_of(counts, across).reshape(f, 3)
    known = Edges(
        ends=np.concatenate([halved(edges, v), np.stack([middle, v + before], axis=1)]),
        of_corner=sides.reshape(-1),
        faces=np.concatenate([np.repeat(edges.faces, 2), np.full(3 * f, 2)]),
        sharpness=np.concatenate([np.repeat(decayed(edges.sharpness), 2), np.zeros(3 * f)]),
    )
    return Cage(
        counts=np.full(4 * f, 3),
        indices=corners.reshape(-1),
        data=np.concatenate([moved, beside], axis=1).T,
        crease_edges=np.empty((0, 2), dtype=np.int64),
        crease_sharpness=np.empty(0),
        corner_sharpness=np.concatenate([decayed(cage.corner_sharpness), np.zeros(e)]),
        face=np.repeat(cage.face, 4),
        known=known,
    )


def linear(counts: Ints, values: Floats) -> tuple[Ints, Floats]:
    """One level of values (k, corners) that are interpolated linearly within each triangle: the new triangles' corners and values."""
    k, f = len(values), len(counts)
    middle = 0.5 * (values + ahead_of(counts, values))
    out = np.empty((k, f, 4, 3))
    out[:, :, :3] = np.stack([values, middle, behind(counts, middle)], axis=-1).reshape(k, f, 3, 3)
    out[:, :, 3] = middle.reshape(k, f, 3)
    return np.full(4 * f, 3), out.reshape(k, -1)


def limit(cage: Cage) -> Cage:
    """Moves the vertices to their limits: the left eigenvector of the subdivision matrix; creases are cubic B-splines."""
    edges, p = cage.edges, cage.columns
    neighbours, degree = _neighbours(edges, p)
    share = 1.0 / (degree + 0.375 / _weights(degree))
    out = (1.0 - degree * share) * p + share * neighbours
    rules = creases.Rules.of(edges, edges.sharpness, cage.corner_sharpness)
    if rules.special:
        along = (4.0 * p + creases.around_sharp(edges, rules.sharp, p)) / 6.0
        out = np.where(rules.corner, p, np.where(rules.crease, along, out))
    return replace(cage, data=np.where(degree > 0, out, p).T)
