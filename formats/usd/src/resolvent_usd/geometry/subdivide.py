"""Catmull–Clark subdivision with creases, corners, boundaries and holes, whole levels at a time.

The rules are OpenSubdiv's, which USD's schema refers to: Catmull and Clark 1978 for smooth vertices, DeRose, Kass and Truong
1998 ("Subdivision surfaces in character animation") for semi-sharp creases, whose sharpness falls by one per level. After the
last level, vertices are moved to their limits, so that they lie on the surface itself.

A level makes of v vertices, e edges and f faces one vertex each, in this order, and of each corner a quadrilateral: the vertex
itself, the point of the edge to the next corner, that of the face, that of the edge before. Sums over neighbours follow from that
and need no search.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from .cage import Bools, Cage, Edges, Floats, Ints, ahead_of, behind, decayed, face_sums, of_faces, sum_at


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
    return sum_at(e[:, 0], p[:, e[:, 1]], p.shape[1]) + sum_at(e[:, 1], p[:, e[:, 0]], p.shape[1])


def _vertex_points(cage: Cage, p: Floats, face_values: Floats) -> Floats:
    """Where one level moves the vertices; ``face_values`` are the faces' points, at their corners."""
    edges, size = cage.edges, p.shape[1]
    a, b = edges.ends.T.copy()
    degree = np.bincount(a, minlength=size) + np.bincount(b, minlength=size)
    n = np.maximum(degree, 1).astype(float)
    neighbours = sum_at(a, p[:, b], size) + sum_at(b, p[:, a], size)
    smooth: Floats = p * ((n - 2.0) / n) + (neighbours + sum_at(cage.indices, face_values, size)) / (n * n)

    def under(rules: _Rules) -> Floats:
        if not rules.special:
            return smooth
        crease = 0.75 * p + 0.125 * _around_sharp(edges, rules.sharp, p)
        return np.asarray(np.where(rules.corner, p, np.where(rules.crease, crease, smooth)))

    now = _Rules.of(edges, edges.sharpness, cage.corner_sharpness)
    moved = under(now)
    if now.special:
        child_edges, child_corners = decayed(edges.sharpness), decayed(cage.corner_sharpness)
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
    face_points = face_sums(counts, p[:, cage.indices]) / counts
    edge_points = 0.5 * (p[:, edges.ends[:, 0]] + p[:, edges.ends[:, 1]])
    vertex_points = p
    if smooth:
        face_values = of_faces(counts, face_points)
        rounded = 0.5 * edge_points + 0.25 * sum_at(edges.of_corner, face_values, e)
        at = np.flatnonzero(edges.sharpness > 0.0)
        share = np.minimum(edges.sharpness[at], 1.0)
        rounded[:, at] = np.where(share >= 1.0, edge_points[:, at], share * edge_points[:, at] + (1.0 - share) * rounded[:, at])
        edge_points = rounded
        vertex_points = _vertex_points(cage, p, face_values)
    quads = np.empty((len(cage.indices), 4), dtype=np.int64)
    quads[:, 0] = cage.indices
    quads[:, 1] = v + edges.of_corner
    quads[:, 2] = of_faces(counts, v + e + np.arange(f))
    quads[:, 3] = behind(counts, quads[:, 1])
    return Cage(
        counts=np.full(len(quads), 4),
        indices=quads.reshape(-1),
        data=np.concatenate([vertex_points, edge_points, face_points], axis=1).T,
        crease_edges=np.empty((0, 2), dtype=np.int64),
        crease_sharpness=np.empty(0),
        corner_sharpness=np.concatenate([decayed(cage.corner_sharpness), np.zeros(e + f)]),
        face=of_faces(counts, cage.face),
        before=cage,
    )


def linear(counts: Ints, values: Floats) -> Floats:
    """One level of values (k, corners) that are interpolated linearly within each face: those of the quadrilaterals' corners."""
    ahead = 0.5 * (values + ahead_of(counts, values))
    centre = of_faces(counts, face_sums(counts, values) / counts)
    return np.stack([values, ahead, centre, behind(counts, ahead)], axis=-1).reshape(len(values), -1)


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
