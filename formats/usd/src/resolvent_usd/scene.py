"""The Resolvent scene that a conversion builds, and the files beside it.

Keys and units are those of ``resolvent schema``. World space is the stage's: its axes, its unit (``units.meters_per_unit``
says how long that is).
"""

from __future__ import annotations

import hashlib
import io
import json
import os
import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

Json = dict[str, Any]
Matrix = NDArray[np.float64]
"""4×4, acts on column vectors: the translation is in the last column. USD's are its transpose."""

INLINE_COPIES = 16
"""More copies than this go to a binary table."""


def rows(matrix: Matrix) -> list[list[float]]:
    """A matrix as scene files write it."""
    return [[float(x) for x in row] for row in matrix]


class Files:
    """Files beside the scene, named by their content: equal ones are written once."""

    def __init__(self, scene_file: Path) -> None:
        self.base = scene_file.parent
        self.folder = scene_file.with_suffix("").name + ".assets"
        self._written: set[str] = set()

    def add(self, stem: str, suffix: str, content: Sequence[bytes | memoryview]) -> str:
        """Writes the pieces of a file and returns its path relative to the scene's folder."""
        digest = hashlib.blake2b(digest_size=10)
        for piece in content:
            digest.update(piece)
        name = f"{self.folder}/{stem}-{digest.hexdigest()}{suffix}"
        if name not in self._written:
            path = self.base / name
            path.parent.mkdir(parents=True, exist_ok=True)
            if not (path.exists() and path.stat().st_size == sum(map(len, content))):
                part = path.with_name(path.name + ".tmp")
                with part.open("wb") as out:
                    out.writelines(content)
                os.replace(part, path)
            self._written.add(name)
        return name

    def relative(self, path: str | Path) -> str:
        """How the scene names a file that exists: relative to its folder where both share one, else absolute."""
        full = os.path.abspath(path)
        base = os.path.abspath(self.base)
        near = os.path.relpath(full, base)
        return full if near.count("..") > 4 else near.replace(os.sep, "/")


class Scene:
    """Builds the scene's JSON."""

    def __init__(self, files: Files) -> None:
        self.files = files
        self.units: Json = {}
        self.camera: Json | None = None
        self.film: Json = {}
        self.sampling: Json = {}
        self.lights: list[Json] = []
        self.textures: dict[str, Json] = {}
        self.materials: dict[str, Json] = {}
        self.media: dict[str, Json] = {}
        self.shapes: list[Json] = []
        self.prototypes: dict[str, list[Json]] = {}
        self.instances: list[Json] = []
        self._keys: dict[tuple[str, str], str] = {}

    def texture(self, name: str, value: Json) -> str:
        """The scene's name of a texture; ``name`` is what it would like to be called."""
        return self._named("textures", self.textures, name, value)

    def material(self, name: str, value: Json) -> str:
        """The scene's name of a material."""
        return self._named("materials", self.materials, name, value)

    def prototype(self, name: str, shapes: list[Json]) -> str:
        """The scene's name of a prototype."""
        return self._named("prototypes", self.prototypes, name, shapes)

    def medium(self, name: str, value: Json) -> str:
        """Adds a medium; unlike the others, equal ones stay two: they would fill space twice."""
        return self._free(self.media, name, value)

    def add_instances(self, prototype: str, matrices: Matrix) -> None:
        """Places copies of a prototype, ``matrices`` of shape (n, 4, 4); many of them go to a binary table."""
        if len(matrices) <= INLINE_COPIES:
            self.instances += [{"prototype": prototype, "transform": rows(m)} for m in matrices]
            return
        table = self.files.add("instances", ".npy", npy(matrices[:, :3, :]))
        self.instances.append({"prototype": prototype, "transforms": table})

    def to_json(self) -> Json:
        scene: Json = {"resolvent": 1}
        for key in ("units", "camera", "film", "sampling", "lights", "textures", "materials", "media"):
            if value := getattr(self, key):
                scene[key] = value
        for key in ("shapes", "prototypes", "instances"):
            if value := getattr(self, key):
                scene[key] = value
        return scene

    def write(self, path: Path) -> None:
        """Writes the scene at once: no reader sees half of it."""
        text = json.dumps(self.to_json(), indent=1, allow_nan=False)
        path.parent.mkdir(parents=True, exist_ok=True)
        part = path.with_name(path.name + ".tmp")
        part.write_text(_short_lists(text), encoding="utf-8")
        os.replace(part, path)

    def _named(self, kind: str, table: dict[str, Any], name: str, value: Any) -> str:
        key = (kind, json.dumps(value, sort_keys=True))
        if key not in self._keys:
            self._keys[key] = self._free(table, name, value)
        return self._keys[key]

    @staticmethod
    def _free(table: dict[str, Any], name: str, value: Any) -> str:
        free, n = name, 1
        while free in table:
            n += 1
            free = f"{name} ({n})"
        table[free] = value
        return free


def npy(array: Matrix) -> Sequence[bytes | memoryview]:
    """The bytes of a NumPy file of little-endian f32, C order."""
    data, header = np.ascontiguousarray(array, dtype="<f4"), io.BytesIO()
    np.lib.format.write_array_header_1_0(header, np.lib.format.header_data_from_array_1_0(data))
    return [header.getvalue(), data.reshape(-1).view(np.uint8).data]


def _short_lists(text: str) -> str:
    """Lists of plain numbers on one line."""
    return re.sub(r"\[\s+([-+\d.eE,\s]+?)\s+\]", lambda m: "[" + re.sub(r"\s+", " ", m[1]) + "]", text)


def rgb(value: Any) -> list[float]:
    """Three numbers of a colour."""
    return [float(x) for x in value]
