"""What creases and corners do to vertices and edges: semi-sharp ones (DeRose, Kass and Truong 1998), boundaries, points that no face uses."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .cage import Bools, Cage, Edges, Floats, Ints, decayed, sum_at


@dataclass(frozen=True)
class Rules:
    """Vertices that are not smooth, at one sharpness of edges and corners."""

    sharp: Bools
    """Of edges."""
    corner: Bools
    crease: Bools

    @staticmethod
    def of(edges: Edges, edge_sharpness: Floats, corner_sharpness: Floats) -> Rules:
        sharp = edge_sharpness > 0
        degree = np.bincount(edges.ends[sharp].reshape(-1), minlength=len(corner_sharpness))
        corner = (corner_sharpness > 0) | (degree > 2)
        return Rules(sharp, corner, ~corner & (degree == 2))

    @property
    def special(self) -> bool:
        return bool(self.corner.any() or self.crease.any())


def around_sharp(edges: Edges, sharp: Bools, p: Floats) -> Floats:
    """For each vertex the sum of the other ends of its sharp edges."""
    e = edges.ends[sharp]
    return sum_at(e[:, 0], p[:, e[:, 1]], p.shape[1]) + sum_at(e[:, 1], p[:, e[:, 0]], p.shape[1])


def edge_points(edges: Edges, middles: Floats, smooth: Floats) -> Floats:
    """Points of edges between their middles and where they are ``smooth`` (which is changed), by their sharpness."""
    at = np.flatnonzero(edges.sharpness > 0.0)
    share = np.minimum(edges.sharpness[at], 1.0)
    smooth[:, at] = np.where(share >= 1.0, middles[:, at], share * middles[:, at] + (1.0 - share) * smooth[:, at])
    return smooth


def vertex_points(cage: Cage, p: Floats, smooth: Floats, degree: Ints) -> Floats:
    """Where one level moves the vertices ``p``, of so many edges; ``smooth`` is where it moves those of no crease or corner."""
    edges, size = cage.edges, p.shape[1]

    def under(rules: Rules) -> Floats:
        if not rules.special:
            return smooth
        crease = 0.75 * p + 0.125 * around_sharp(edges, rules.sharp, p)
        return np.asarray(np.where(rules.corner, p, np.where(rules.crease, crease, smooth)))

    now = Rules.of(edges, edges.sharpness, cage.corner_sharpness)
    moved = under(now)
    if now.special:
        child_edges, child_corners = decayed(edges.sharpness), decayed(cage.corner_sharpness)
        then = Rules.of(edges, child_edges, child_corners)
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
