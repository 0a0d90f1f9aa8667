"""Areas of what transforms make of disks, spheres and cylinders, and meshes of the same area."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]
Ints = NDArray[np.int64]


def ellipse(u: Floats, v: Floats) -> float:
    """Of the ellipse c + u cos φ + v sin φ."""
    return float(np.pi * np.linalg.norm(np.cross(u, v)))


def cylinder(axis: Floats, u: Floats, v: Floats) -> float:
    """Of the lateral surface over that ellipse: ∫ |axis × t(φ)| dφ, whose trapezoidal sum converges exponentially."""
    phi = 2.0 * np.pi * np.arange(4096) / 4096
    tangent = np.outer(np.cos(phi), v) - np.outer(np.sin(phi), u)
    return float(np.linalg.norm(np.cross(axis, tangent), axis=1).mean() * 2.0 * np.pi)


def is_similar(axes: Floats) -> bool:
    """True if the columns of ``axes`` are of one length and perpendicular."""
    gram = axes.T @ axes
    scale = np.trace(gram) / 3.0
    return bool(np.abs(gram - scale * np.eye(3)).max() <= 2e-6 * scale)


def ellipsoid(axes: Floats) -> float:
    """Of the image of the unit sphere: ∫ |cof(A) n| dω, by Gauss–Legendre nodes in z and a trapezoidal sum in φ."""
    if is_similar(axes):
        return float(4.0 * np.pi * np.linalg.norm(axes[:, 0]) ** 2)
    cofactor = np.stack([np.cross(axes[:, 1], axes[:, 2]), np.cross(axes[:, 2], axes[:, 0]), np.cross(axes[:, 0], axes[:, 1])], axis=1)
    z, weight = np.polynomial.legendre.leggauss(256)
    phi = 2.0 * np.pi * np.arange(512) / 512
    r = np.sqrt(1.0 - z * z)
    n = np.stack([np.outer(r, np.cos(phi)), np.outer(r, np.sin(phi)), np.outer(z, np.ones_like(phi))], axis=-1)
    size = np.linalg.norm(n @ cofactor.T, axis=-1).mean(axis=1)
    return float(2.0 * np.pi * weight @ size)


def _mesh_area(positions: Floats, indices: Ints) -> float:
    a, b, c = (positions[indices[:, k]] for k in range(3))
    return float(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1).sum())


def ellipse_mesh(u: Floats, v: Floats, normal: Floats, sides: int) -> tuple[Floats, Ints]:
    """A polygon of the ellipse's area, facing ``normal``."""
    phi = 2.0 * np.pi * np.arange(sides) / sides
    rim = np.outer(np.cos(phi), u) + np.outer(np.sin(phi), v)
    rim *= np.sqrt(2.0 * np.pi / sides / np.sin(2.0 * np.pi / sides))
    k = np.arange(sides)
    indices = np.stack([np.full(sides, sides), k, (k + 1) % sides], axis=1)
    if np.cross(u, v) @ normal < 0.0:
        indices = indices[:, [0, 2, 1]]
    return np.concatenate([rim, np.zeros((1, 3))]), indices


def cylinder_mesh(axis: Floats, u: Floats, v: Floats, sides: int) -> tuple[Floats, Ints]:
    """A prism of the lateral surface's area, facing outwards."""
    phi = 2.0 * np.pi * np.arange(sides) / sides
    rim = np.outer(np.cos(phi), u) + np.outer(np.sin(phi), v)
    positions = np.concatenate([rim - 0.5 * axis, rim + 0.5 * axis])
    k = np.arange(sides)
    after = (k + 1) % sides
    indices = np.concatenate([np.stack([k, after, after + sides], axis=1), np.stack([k, after + sides, k + sides], axis=1)])
    if np.cross(u, v) @ axis < 0.0:
        indices = indices[:, [0, 2, 1]]
    # Wider only: the ends stay where they are.
    target = cylinder(axis, u, v)
    factor = target / _mesh_area(positions, indices)
    positions = np.concatenate([factor * rim - 0.5 * axis, factor * rim + 0.5 * axis])
    return positions, indices


def ellipsoid_mesh(axes: Floats, level: int = 5) -> tuple[Floats, Ints]:
    """The image of a subdivided icosahedron, of the ellipsoid's area, facing outwards."""
    positions, indices = _icosahedron()
    for _ in range(level):
        positions, indices = _split(positions, indices)
    if np.linalg.det(axes) < 0.0:
        indices = indices[:, [0, 2, 1]]
    placed = positions @ axes.T
    return placed * np.sqrt(ellipsoid(axes) / _mesh_area(placed, indices)), indices


def _icosahedron() -> tuple[Floats, Ints]:
    g = 0.5 * (1.0 + np.sqrt(5.0))
    corners = [[0.0, s, t * g] for s in (-1, 1) for t in (-1, 1)]
    positions = np.array([np.roll(c, k) for k in range(3) for c in corners])
    triples = np.array([(i, j, k) for i in range(12) for j in range(i) for k in range(j)])
    a, b, c = (positions[triples[:, n]] for n in range(3))
    near = [np.linalg.norm(p - q, axis=1) < 2.1 for p, q in ((a, b), (b, c), (c, a))]
    faces = near[0] & near[1] & near[2]
    triples, a, b, c = triples[faces], a[faces], b[faces], c[faces]
    inwards = np.einsum("ij,ij->i", np.cross(b - a, c - a), a) < 0.0
    triples[inwards] = triples[inwards][:, [0, 2, 1]]
    return positions / np.linalg.norm(positions[0]), triples


def _split(positions: Floats, indices: Ints) -> tuple[Floats, Ints]:
    """Each triangle as four, on the unit sphere."""
    edges = np.sort(indices[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, inverse = np.unique(edges, axis=0, return_inverse=True)
    middle = positions[unique].sum(axis=1)
    middle /= np.linalg.norm(middle, axis=1, keepdims=True)
    ab, bc, ca = (inverse.reshape(-1, 3) + len(positions)).T
    a, b, c = indices.T
    split = np.concatenate([np.stack(t, axis=1) for t in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))])
    return np.concatenate([positions, middle]), split
