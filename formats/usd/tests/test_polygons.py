"""Polygons to triangles: areas add up, no triangle turns the wrong way or leaves its polygon."""

from __future__ import annotations

import numpy as np
import pytest
from resolvent_usd.geometry.polygons import MANY, _clip, clip_ears, triangulate


def area(p: np.ndarray) -> np.ndarray:
    return 0.5 * np.cross(p, np.roll(p, -1, axis=0)).sum(axis=0)


def cut(points: np.ndarray, counts: list[int], indices: list[int]) -> tuple[np.ndarray, np.ndarray]:
    corners, faces = triangulate(points, np.array(counts), np.array(indices))
    return np.array(indices)[corners], faces


def random_star(rng: np.random.Generator, n: int) -> np.ndarray:
    """A polygon that the origin sees all of, mostly concave."""
    angle = 2 * np.pi * (np.arange(n) + rng.uniform(0, 0.8, n)) / n
    radius = rng.uniform(0.1, 1, n)
    return np.stack([radius * np.cos(angle), radius * np.sin(angle), np.zeros(n)], axis=1)


@pytest.mark.parametrize("n", [4, 5, 6, 9, 23, 60])
def test_concave_polygons_keep_their_area(n: int) -> None:
    rng = np.random.default_rng(n)
    for _ in range(30):
        turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
        p = random_star(rng, n) @ turn.T + rng.normal(size=3)
        triangles, faces = cut(p, [n], list(range(n)))
        assert triangles.shape == (n - 2, 3) and (faces == 0).all()
        t = p[triangles]
        parts = 0.5 * np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])
        whole = area(p)
        assert np.allclose(parts.sum(axis=0), whole, atol=1e-9)
        # All turn as the polygon does: with the right sum, none overlap or stick out.
        assert (parts @ whole >= -1e-12).all()


def test_spiral_and_comb() -> None:
    comb = [(0, 0), (9, 0), (9, 5), (8, 1), (7, 5), (6, 1), (5, 5), (4, 1), (3, 5), (2, 1), (1, 5), (0, 1)]
    steps = np.arange(24)
    outward = [(0.2 * k * np.cos(0.7 * k), 0.2 * k * np.sin(0.7 * k)) for k in steps + 2]
    back = [((0.2 * k - 0.3) * np.cos(0.7 * k), (0.2 * k - 0.3) * np.sin(0.7 * k)) for k in steps[::-1] + 2]
    for flat in (comb, outward + back):
        p = np.array([(x, y, 0.0) for x, y in flat])
        if area(p)[2] < 0:
            p = p[::-1]
        triangles, _ = cut(p, [len(p)], list(range(len(p))))
        t = p[triangles]
        parts = 0.5 * np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])[:, 2]
        assert parts.min() >= -1e-9
        assert parts.sum() == pytest.approx(area(p)[2])


def test_mixed_counts_come_in_the_order_of_faces() -> None:
    p = np.array([(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0), (2, 0.5, 0), (3, 0, 0), (3, 1, 0)], dtype=float)
    triangles, faces = cut(p, [4, 3, 5, 3], [0, 1, 2, 3, 1, 4, 2, 0, 1, 4, 2, 3, 4, 5, 6])
    assert faces.tolist() == [0, 0, 1, 2, 2, 2, 3]
    assert triangles[2].tolist() == [1, 4, 2]


def test_arrowhead_quads_are_cut_at_the_reflex_corner() -> None:
    arrow = np.array([(0, 0, 0), (2, -1, 0), (0.5, 0, 0), (2, 1, 0)], dtype=float)
    for shift in range(4):
        p = np.roll(arrow, shift, axis=0)
        triangles, _ = cut(p, [4], [0, 1, 2, 3])
        t = p[triangles]
        parts = 0.5 * np.cross(t[:, 1] - t[:, 0], t[:, 2] - t[:, 0])[:, 2]
        assert np.sign(parts[0]) == np.sign(parts[1])
        assert parts.sum() == pytest.approx(area(p)[2])


def test_degenerate_polygons_end() -> None:
    """Points on a line, repeated points, a figure of eight: n − 2 triangles, whatever they are worth."""
    line = np.array([(k, 0, 0) for k in range(6)], dtype=float)
    same = np.zeros((7, 3))
    eight = np.array([(0, 0, 0), (1, 1, 0), (1, 0, 0), (0, 1, 0), (0.5, 2, 0)], dtype=float)
    for p in (line, same, eight):
        triangles, _ = cut(p, [len(p)], list(range(len(p))))
        assert triangles.shape == (len(p) - 2, 3)


@pytest.mark.parametrize("n", [4, 5, 7, 16, MANY, MANY + 1])
def test_many_polygons_are_cut_like_each_alone(n: int) -> None:
    """Concave ones, ones that cross themselves, and points on a coarse grid, of which some coincide."""
    rng = np.random.default_rng(n)
    stars = np.stack([random_star(rng, n)[:, :2] for _ in range(20)])
    polygons = np.concatenate([stars, rng.normal(size=(20, n, 2)), rng.integers(0, 4, (20, n, 2)).astype(float)])
    for p, triangles in zip(polygons, _clip(polygons), strict=True):
        assert np.array_equal(triangles, clip_ears(p))
