"""What the writers of a stage share."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any

import numpy as np
from pxr import Gf, Sdf, Usd, UsdGeom

from ..report import Report
from ..scene import Json, Matrix


class Target:
    """A stage in the making, and the scene that it is made of."""

    def __init__(self, stage: Usd.Stage, scene: Json, scene_file: Path, stage_file: Path, report: Report) -> None:
        self.stage = stage
        self.scene = scene
        self.scene_file = scene_file
        self.stage_file = stage_file
        self.report = report
        self._names: set[str] = set()

    def path(self, name: str, parent: str = "/World") -> Sdf.Path:
        """A free path for something of this name."""
        plain = re.sub(r"[^A-Za-z0-9_]+", "_", name.rsplit("/", 1)[-1]) or "prim"
        plain = plain if not plain[0].isdigit() else f"_{plain}"
        free, n = f"{parent}/{plain}", 1
        while free in self._names:
            n += 1
            free = f"{parent}/{plain}_{n}"
        self._names.add(free)
        return Sdf.Path(free)

    def file(self, name: str) -> Path:
        """A file that the scene names."""
        return self.scene_file.parent / name

    def asset(self, name: str) -> Sdf.AssetPath:
        """The same, as the stage names it."""
        full = os.path.abspath(self.file(name))
        near = os.path.relpath(full, os.path.abspath(self.stage_file.parent))
        return Sdf.AssetPath(full if near.count("..") > 4 else "./" + near.replace(os.sep, "/"))


def place(xformable: UsdGeom.Xformable, matrix: Matrix) -> None:
    """Gives a prim its matrix."""
    if not np.array_equal(matrix, np.eye(4)):
        xformable.AddTransformOp().Set(Gf.Matrix4d(matrix.T.tolist()))


def color(value: Any) -> Gf.Vec3f:
    """One number or three."""
    array = np.asarray(value, dtype=float).reshape(-1)
    return Gf.Vec3f(*map(float, np.repeat(array, 3) if array.size == 1 else array))


def matrix(value: Any) -> Matrix:
    """A scene's transform: four rows, or operations of which the first acts first."""
    if value is None:
        return np.eye(4)
    if not isinstance(value[0], dict):
        return np.asarray(value, dtype=float)
    out: Matrix = np.eye(4)
    for operation in value:
        ((kind, v),) = operation.items()
        m: Matrix = np.eye(4)
        if kind == "translate":
            m[:3, 3] = v
        elif kind == "scale":
            m[:3, :3] = np.diag(np.repeat(v, 3) if np.isscalar(v) else v)
        elif kind == "rotate_deg":
            axis = Gf.Vec3d(*map(float, v["axis"]))
            m[:3, :3] = np.array(Gf.Matrix3d(Gf.Rotation(axis, float(v["angle"])))).T
        else:
            m = matrix(v)
        out = m @ out
    return out


def frame(x: Any, y: Any, z: Any, origin: Any) -> Matrix:
    """The matrix with these columns."""
    out: Matrix = np.eye(4)
    for i, column in enumerate((x, y, z, origin)):
        out[:3, i] = column
    return out


def around(z: Any) -> Matrix:
    """A rotation that takes +z to this direction."""
    w = np.asarray(z, dtype=float) / np.linalg.norm(z)
    side = np.eye(3)[np.argmin(np.abs(w))]
    x = np.cross(side, w)
    x /= np.linalg.norm(x)
    return frame(x, np.cross(w, x), w, (0, 0, 0))
