"""Transforms: USD's row-vector matrices as the scene's column-vector ones."""

from __future__ import annotations

import numpy as np
from pxr import Gf, Usd

from .context import Context
from .report import InputError
from .scene import Matrix

_SINGULAR = 1e-14


def matrix_of(value: Gf.Matrix4d) -> Matrix:
    """A USD matrix as one that acts on column vectors."""
    return np.array(value, dtype=float).T.copy()


def local_matrix(ctx: Context, prim: Usd.Prim) -> tuple[Matrix, bool]:
    """A prim's transform to its parent's space, and whether it resets the stack (is relative to the world)."""
    value, resets = ctx.xforms.GetLocalTransformation(prim)
    matrix = matrix_of(value)
    if not np.isfinite(matrix).all():
        raise InputError(prim.GetPath(), "its transform has numbers that are not finite (NaN or infinity)")
    if not np.array_equal(matrix[3], [0, 0, 0, 1]):
        ctx.report.approximated(
            prim.GetPath(), "xformOpOrder", f"its matrix is no affine one: the last column is {matrix[3].tolist()}",
            "(0, 0, 0, 1) is used there",
        )  # fmt: skip
        matrix[3] = [0, 0, 0, 1]
    return matrix, bool(resets)


def singular(matrix: Matrix) -> bool:
    """True if the transform flattens space: nothing under it can be seen."""
    linear = matrix[:3, :3]
    size = float(np.prod(np.linalg.norm(linear, axis=1)))
    return abs(float(np.linalg.det(linear))) <= _SINGULAR * size
