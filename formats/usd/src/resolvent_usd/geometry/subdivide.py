"""Catmull–Clark subdivision with creases, corners, boundaries and holes, whole levels at a time.

The rules are OpenSubdiv's, which USD's schema refers to: Catmull and Clark 1978 for smooth vertices, DeRose, Kass and Truong
1998 ("Subdivision surfaces in character animation") for semi-sharp creases, whose sharpness falls by one per level. After the
last level, vertices are moved to their limits, so that they lie on the surface itself.

A level makes of v vertices, e edges and f faces one vertex each, in this order, and of each corner a quadrilateral: the vertex
itself, the point of the edge to the next corner, that of the face, that of the edge before. Sums over neighbours follow from that
and need no search.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from . import creases
from .cage import Cage, Floats, Ints, ahead_of, behind, decayed, face_sums, of_faces, sum_at


def step(cage: Cage, smooth: bool = True) -> Cage:
    """One level: a face of n corners becomes n quadrilaterals. ``smooth`` false is bilinear subdivision."""
    edges, counts, p = cage.edges, cage.counts, cage.columns
    v, e, f = p.shape[1], len(edges.ends), len(counts)
    a, b = edges.ends.T.copy()
    face_points = face_sums(counts, p[:, cage.indices]) / counts
    middles = 0.5 * (p[:, a] + p[:, b])
    if smooth:
        face_values = of_faces(counts, face_points)
        beside = creases.edge_points(edges, middles, 0.5 * middles + 0.25 * sum_at(edges.of_corner, face_values, e))
        degree = np.bincount(a, minlength=v) + np.bincount(b, minlength=v)
        n = np.maximum(degree, 1).astype(float)
        neighbours = sum_at(a, p[:, b], v) + sum_at(b, p[:, a], v)
        rounded: Floats = p * ((n - 2.0) / n) + (neighbours + sum_at(cage.indices, face_values, v)) / (n * n)
        points = [creases.vertex_points(cage, p, rounded, degree), beside, face_points]
    else:
        points = [p, middles, face_points]
    quads = np.empty((len(cage.indices), 4), dtype=np.int64)
    quads[:, 0] = cage.indices
    quads[:, 1] = v + edges.of_corner
    quads[:, 2] = of_faces(counts, v + e + np.arange(f))
    quads[:, 3] = behind(counts, quads[:, 1])
    return Cage(
        counts=np.full(len(quads), 4),
        indices=quads.reshape(-1),
        data=np.concatenate(points, axis=1).T,
        crease_edges=np.empty((0, 2), dtype=np.int64),
        crease_sharpness=np.empty(0),
        corner_sharpness=np.concatenate([decayed(cage.corner_sharpness), np.zeros(e + f)]),
        face=of_faces(counts, cage.face),
        before=cage,
    )


def linear(counts: Ints, values: Floats) -> tuple[Ints, Floats]:
    """One level of values (k, corners) that are interpolated linearly within each face: the new faces' corners and values."""
    ahead = 0.5 * (values + ahead_of(counts, values))
    centre = of_faces(counts, face_sums(counts, values) / counts)
    out = np.stack([values, ahead, centre, behind(counts, ahead)], axis=-1).reshape(len(values), -1)
    return np.full(values.shape[1], 4), out


def limit(cage: Cage) -> Cage:
    """Moves the vertices of a mesh after a level to their limits (Halstead, Kass and DeRose 1993; creases: cubic B-splines)."""
    old = cage.before
    assert old is not None, "limits are known after a level"
    edges, counts, p = old.edges, old.counts, cage.columns
    v, e, f = len(old.data), len(edges.ends), len(counts)
    a, b = edges.ends.T.copy()
    vertices, middles, centres = p[:, :v], p[:, v : v + e], p[:, v + e :]
    at_edge = middles[:, edges.of_corner]
    at_face = of_faces(counts, centres)
    before = behind(counts, edges.of_corner)
    out = np.empty_like(p)

    def smooth(part: slice, degree: Ints, neighbours: Floats, across: Floats) -> None:
        """Points with so many neighbours, the sum of these, and that of what lies across the quadrilaterals."""
        n = np.maximum(degree, 1).astype(float)
        here = np.multiply(n * n, p[:, part], out=out[:, part])
        here += np.multiply(neighbours, 4.0, out=neighbours)
        here += across
        here /= n * (n + 5.0)

    degree = np.bincount(a, minlength=v) + np.bincount(b, minlength=v)
    smooth(slice(0, v), degree, sum_at(a, middles, v) + sum_at(b, middles, v), sum_at(old.indices, at_face, v))
    if (unused := np.flatnonzero(degree == 0)).size:
        out[:, unused] = p[:, unused]
    beside = sum_at(edges.of_corner, at_face, e) + (vertices[:, a] + vertices[:, b])
    across = sum_at(edges.of_corner, behind(counts, at_edge), e) + sum_at(before, at_edge, e)
    smooth(slice(v, v + e), 2 + edges.faces, beside, across)
    smooth(slice(v + e, v + e + f), counts, face_sums(counts, at_edge), face_sums(counts, vertices[:, old.indices]))
    # Sharp halves of edges, and the corners, as the rules of the last level have them.
    sharp = np.flatnonzero(decayed(edges.sharpness) > 0)
    sharp_degree = np.bincount(edges.ends[sharp].reshape(-1), minlength=v)
    fixed = (cage.corner_sharpness[:v] > 0) | (sharp_degree > 2)
    crease = np.flatnonzero(~fixed & (sharp_degree == 2))
    along = sum_at(a[sharp], middles[:, sharp], v) + sum_at(b[sharp], middles[:, sharp], v)
    out[:, crease] = (4.0 * p[:, crease] + along[:, crease]) / 6.0
    out[:, v + sharp] = (4.0 * middles[:, sharp] + (vertices[:, a[sharp]] + vertices[:, b[sharp]])) / 6.0
    at = np.flatnonzero(fixed)
    out[:, at] = p[:, at]
    return replace(cage, data=out.T)
