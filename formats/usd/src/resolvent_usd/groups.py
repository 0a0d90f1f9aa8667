"""Groups of shapes: the world and the prototypes of instances, nested as the stage has them.

The scene format has one level of instances. Nested ones are multiplied out at the end: still true copies of the
innermost shapes, with the products of the matrices.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, field

import numpy as np

from .report import InputError
from .scene import Json, Matrix, Scene, rows

MAX_COPIES = 100_000_000
"""Copies in one scene; the renderer keeps about 200 bytes for each."""

# Shapes that have a key `transform`.
PLACED = {"mesh", "ply", "gltf"}


@dataclass
class Copies:
    """A group, placed by matrices of shape (n, 4, 4)."""

    group: Group
    matrices: Matrix


@dataclass
class Group:
    """Shapes with one space, copies of other groups in it, and what must be made for each copy apart."""

    name: str
    shapes: list[tuple[Json, Matrix]] = field(default_factory=list)
    copies: list[Copies] = field(default_factory=list)
    deferred: list[tuple[Callable[[Matrix], None], Matrix]] = field(default_factory=list)

    def add(self, shape: Json, matrix: Matrix) -> None:
        """Adds a shape in a space of its own."""
        self.shapes.append((shape, matrix))

    def defer(self, make: Callable[[Matrix], None], matrix: Matrix) -> None:
        """Calls ``make`` with the matrix to the world, for every copy of the group."""
        self.deferred.append((make, matrix))


def lay_out(world: Group, scene: Scene) -> None:
    """Writes all groups into the scene."""
    for shape, matrix in world.shapes:
        _place(scene, world.name, shape, matrix)
    for make, matrix in world.deferred:
        make(matrix)
    # Copies of one group may come from several places.
    placed: dict[int, tuple[Group, list[Matrix]]] = {}
    total = 0
    for group, matrices in _flatten(world):
        total += len(matrices)
        if total > MAX_COPIES:
            raise InputError(group.name, f"more than {MAX_COPIES} copies, nested ones multiplied out")
        placed.setdefault(id(group), (group, []))[1].append(matrices)
    for group, lists in placed.values():
        matrices = np.concatenate(lists)
        for make, matrix in group.deferred:
            for m in matrices:
                make(m @ matrix)
        # Shapes in the group's own space, whatever the format calls it: one prototype each for those without a transform.
        plain = [_in_place(shape, matrix) for shape, matrix in group.shapes]
        together = [s for s in plain if s is not None]
        if together:
            scene.add_instances(scene.prototype(group.name, together), matrices)
        for (shape, matrix), direct in zip(group.shapes, plain, strict=True):
            if direct is None:
                scene.add_instances(scene.prototype(f"{group.name} {shape['type']}", [shape]), matrices @ matrix)


def _flatten(group: Group) -> Iterator[tuple[Group, Matrix]]:
    """Pairs of a group and the matrices of its copies, relative to ``group``. Iterative: stages nest as deep as they like."""
    stack = [(copies.group, copies.matrices) for copies in reversed(group.copies)]
    while stack:
        inner, matrices = stack.pop()
        yield inner, matrices
        for copies in reversed(inner.copies):
            count = len(matrices) * len(copies.matrices)
            if count > MAX_COPIES:
                raise InputError(inner.name, f"more than {MAX_COPIES} copies, nested ones multiplied out")
            product = np.einsum("aij,bjk->abik", matrices, copies.matrices).reshape(-1, 4, 4)
            stack.append((copies.group, product))


def _place(scene: Scene, name: str, shape: Json, matrix: Matrix) -> None:
    direct = _in_place(shape, matrix)
    if direct is not None:
        scene.shapes.append(direct)
    else:
        scene.add_instances(scene.prototype(f"{name} {shape['type']}", [shape]), matrix[None])


def _in_place(shape: Json, matrix: Matrix) -> Json | None:
    """The shape with its transform; None for a shape without the key that a matrix moves."""
    if np.array_equal(matrix, np.eye(4)):
        return shape
    if shape["type"] in PLACED:
        return {**shape, "transform": rows(matrix)}
    scale = similarity(matrix) if shape["type"] == "sphere" else None
    if scale is None:
        return None
    centre = matrix[:3, :3] @ np.asarray(shape["center"]) + matrix[:3, 3]
    return {**shape, "center": [float(x) for x in centre], "radius": shape["radius"] * scale}


def similarity(matrix: Matrix) -> float | None:
    """The factor on all lengths, if the matrix has one."""
    linear = matrix[:3, :3]
    scale = float(np.cbrt(abs(np.linalg.det(linear))))
    square = linear.T @ linear
    return scale if np.abs(square - scale**2 * np.eye(3)).max() <= 1e-9 * scale**2 else None
