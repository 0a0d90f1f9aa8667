"""What tests share: converting stages, and reading what comes out without the converter's own code."""

from __future__ import annotations

import itertools
import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from pxr import Usd

from resolvent_usd.context import Options
from resolvent_usd.convert import convert, open_stage
from resolvent_usd.report import Report

# A grey pixel.
PIXEL = bytes.fromhex(
    "89504e470d0a1a0a0000000d4948445200000001000000010800000000" + "3a7e9b55" + "0000000a49444154789c6368000000820081"
    + "77cd72b6" + "0000000049454e44ae426082"
)  # fmt: skip
DATA = Path(__file__).parent / "data" / "usd"


@dataclass
class Converted:
    """A scene as it was written."""

    file: Path
    scene: dict[str, Any]
    report: Report

    def path(self, name: str) -> Path:
        return self.file.parent / name

    def losses(self, path: str) -> list[str]:
        return [f"{x.what}: {x.reason}" for x in self.report.losses if x.path == path]

    def copies(self) -> Iterator[tuple[dict[str, Any], np.ndarray]]:
        """All shapes with all their matrices to the world."""
        for shape in self.scene.get("shapes", []):
            yield shape, np.eye(4)
        for instance in self.scene.get("instances", []):
            outer = np.array(instance.get("transform", np.eye(4)))
            matrices = [np.eye(4)]
            if "transforms" in instance:
                table = np.load(self.path(instance["transforms"]))
                matrices = [np.vstack([m, [0, 0, 0, 1]]) for m in table]
            for shape in self.scene["prototypes"][instance["prototype"]]:
                for m in matrices:
                    yield shape, outer @ m

    def mesh(self, shape: dict[str, Any]) -> dict[str, np.ndarray]:
        return read_glb(self.path(shape["file"]))

    def meshes(self) -> list[dict[str, np.ndarray]]:
        return [self.mesh(s) for s, _ in self.copies() if s["type"] == "gltf"]

    def points(self) -> np.ndarray:
        """World positions of all meshes' corners, and two corners of a box around each sphere."""
        out = [np.empty((0, 3))]
        for shape, matrix in self.copies():
            m = matrix @ np.array(shape.get("transform", np.eye(4)))
            if shape["type"] == "gltf":
                out.append(moved(self.mesh(shape)["POSITION"], m))
            elif shape["type"] == "sphere" and "emission" not in shape:
                out.append(sphere_box(m, shape["center"], shape["radius"]))
        return np.concatenate(out)


def moved(points: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    return np.asarray(points, dtype=float) @ matrix[:3, :3].T + matrix[:3, 3]


def sphere_box(matrix: np.ndarray, centre: Any, radius: float) -> np.ndarray:
    c = moved(np.array([centre]), matrix)[0]
    r = radius * np.linalg.norm(matrix[:3, :3], axis=1)
    return np.array([c - r, c + r])


def read_glb(path: Path) -> dict[str, np.ndarray]:
    """Attributes and triangles of a .glb with one primitive; v upwards again."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<I4s", data, 12)
    assert kind == b"JSON" and size % 4 == 0
    root = json.loads(data[20 : 20 + size])
    binary = data[20 + size + 8 :]
    (primitive,) = root["meshes"][0]["primitives"]

    def read(index: int) -> np.ndarray:
        accessor = root["accessors"][index]
        view = root["bufferViews"][accessor["bufferView"]]
        width = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[accessor["type"]]
        dtype = {5125: "<u4", 5126: "<f4"}[accessor["componentType"]]
        flat = np.frombuffer(binary, dtype, accessor["count"] * width, view["byteOffset"])
        return flat.reshape(-1, width) if width > 1 else flat

    out = {name: read(i) for name, i in primitive["attributes"].items()}
    if "TEXCOORD_0" in out:
        out["TEXCOORD_0"] = out["TEXCOORD_0"] * [1, -1] + [0, 1]
    out["triangles"] = read(primitive["indices"]).reshape(-1, 3)
    return out


def area_vectors(mesh: dict[str, np.ndarray]) -> np.ndarray:
    """Normals of the triangles, of their areas' lengths."""
    p = mesh["POSITION"].astype(float)[mesh["triangles"]]
    return 0.5 * np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0])


@pytest.fixture
def convert_text(tmp_path: Path):
    """Converts the text of a .usda file; beside it is a picture texture.png."""
    (tmp_path / "texture.png").write_bytes(PIXEL)
    # USD keeps layers by their paths.
    numbers = itertools.count()

    def run(text: str, **options: Any) -> Converted:
        source = tmp_path / f"stage{next(numbers)}.usda"
        # One statement a line: so that tests can write several.
        source.write_text("#usda 1.0\n" + text.replace("; ", "\n").replace("{ ", "{\n").replace(" }", "\n}\n").replace("} ", "}\n"))
        return convert_file(source, tmp_path / "out.json", **options)

    return run


def convert_file(source: Path, out: Path, **options: Any) -> Converted:
    report, chosen = Report(), Options(**options)
    stage = open_stage(str(source), chosen, report)
    return convert_stage(stage, out, report, chosen)


def convert_stage(stage: Usd.Stage, out: Path, report: Report | None = None, options: Options | None = None) -> Converted:
    report = report or Report()
    convert(stage, out, options or Options(), report)
    return Converted(out, json.loads(out.read_text()), report)
