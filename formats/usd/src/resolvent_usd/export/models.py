"""Triangles of binary glTF files, as the converter writes them."""

from __future__ import annotations

import json
import struct
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..report import InputError

_TYPES = {5121: "<u1", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}


@dataclass(frozen=True)
class Mesh:
    """One primitive in the model's space."""

    positions: NDArray[Any]
    indices: NDArray[Any]
    normals: NDArray[Any] | None
    uvs: NDArray[Any] | None
    """v upwards."""


def read(path: Path) -> Iterator[Mesh]:
    """The primitives of a .glb file whose nodes have no transforms; anything else is an error."""
    data = path.read_bytes()
    if data[:4] != b"glTF":
        raise InputError(path, "only binary glTF (.glb) is written to stages")
    length = struct.unpack_from("<I", data, 12)[0]
    document = json.loads(data[20 : 20 + length])
    binary = data[28 + length :]
    if any({"matrix", "translation", "rotation", "scale"} & set(n) for n in document.get("nodes", [])):
        raise InputError(path, "a model with moved nodes is not written to stages")

    def array(index: int) -> NDArray[Any]:
        accessor = document["accessors"][index]
        view = document["bufferViews"][accessor["bufferView"]]
        if "byteStride" in view or "sparse" in accessor:
            raise InputError(path, "interleaved or sparse data is not written to stages")
        kind, size = np.dtype(_TYPES[accessor["componentType"]]), _SIZES[accessor["type"]]
        start = view.get("byteOffset", 0) + accessor.get("byteOffset", 0)
        flat = np.frombuffer(binary, kind, accessor["count"] * size, start)
        return flat.reshape(-1, size) if size > 1 else flat

    for mesh in document.get("meshes", []):
        for primitive in mesh["primitives"]:
            attributes = primitive["attributes"]
            positions = array(attributes["POSITION"])
            indices = array(primitive["indices"]) if "indices" in primitive else np.arange(len(positions))
            uvs = array(attributes["TEXCOORD_0"]) if "TEXCOORD_0" in attributes else None
            if uvs is not None:
                uvs = np.stack([uvs[:, 0], 1.0 - uvs[:, 1]], axis=1)
            normals = array(attributes["NORMAL"]) if "NORMAL" in attributes else None
            yield Mesh(positions, indices.reshape(-1, 3), normals, uvs)
