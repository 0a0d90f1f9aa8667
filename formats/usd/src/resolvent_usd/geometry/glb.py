"""Triangles as binary glTF (glTF 2.0, one mesh with one primitive)."""

from __future__ import annotations

import json
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.floating[Any]]
IntArray = NDArray[np.integer[Any]]

Content = bytes | memoryview

_F32, _U32 = 5126, 5125
_ARRAY_BUFFER, _ELEMENT_ARRAY_BUFFER = 34962, 34963


@dataclass(frozen=True)
class Triangles:
    """Corners and the triangles between them, counter-clockwise seen from outside."""

    positions: FloatArray
    """(n, 3)"""
    indices: IntArray
    """(m, 3)"""
    normals: FloatArray | None = None
    """(n, 3), unit length"""
    uvs: FloatArray | None = None
    """(n, 2), v upwards"""
    colors: FloatArray | None = None
    """(n, 4), linear RGB and opacity"""


def compact(t: Triangles) -> Triangles:
    """Without the corners that no triangle uses."""
    used = np.zeros(len(t.positions), dtype=bool)
    used[t.indices] = True
    if used.all():
        return t
    new = np.cumsum(used, dtype=np.int64) - 1

    def pick(a: FloatArray | None) -> FloatArray | None:
        return None if a is None else a[used]

    return Triangles(t.positions[used], new[t.indices], pick(t.normals), pick(t.uvs), pick(t.colors))


def write(t: Triangles) -> list[Content]:
    """The bytes of the .glb file, in pieces."""
    chunks: list[Content] = []
    size = 0
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def add(array: NDArray[Any], kind: str, component: int, target: int, bounds: bool = False) -> int:
        nonlocal size
        data = np.ascontiguousarray(array, dtype="<u4" if component == _U32 else "<f4")
        views.append({"buffer": 0, "byteOffset": size, "byteLength": data.nbytes, "target": target})
        size += data.nbytes
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1, "componentType": component, "count": len(data), "type": kind,
        }  # fmt: skip
        if bounds:
            accessor["min"], accessor["max"] = (_along_rows(f, data).tolist() for f in (np.minimum, np.maximum))
        accessors.append(accessor)
        chunks.append(data.reshape(-1).view(np.uint8).data)
        return len(accessors) - 1

    attributes = {"POSITION": add(t.positions, "VEC3", _F32, _ARRAY_BUFFER, bounds=True)}
    if t.normals is not None:
        attributes["NORMAL"] = add(t.normals, "VEC3", _F32, _ARRAY_BUFFER)
    if t.uvs is not None:
        # glTF's v points down.
        flipped = np.array(t.uvs, dtype="<f4")
        flipped[:, 1] = 1.0 - t.uvs[:, 1].astype(float)
        attributes["TEXCOORD_0"] = add(flipped, "VEC2", _F32, _ARRAY_BUFFER)
    if t.colors is not None:
        attributes["COLOR_0"] = add(t.colors, "VEC4", _F32, _ARRAY_BUFFER)
    indices = add(t.indices.reshape(-1), "SCALAR", _U32, _ELEMENT_ARRAY_BUFFER)
    root = {
        "asset": {"version": "2.0", "generator": "resolvent_usd"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": indices}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": size}],
    }
    text = json.dumps(root, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + size
    header = struct.pack("<4sII", b"glTF", 2, total)
    json_chunk = struct.pack("<I4s", len(text), b"JSON") + text
    return [header + json_chunk + struct.pack("<I4s", size, b"BIN\0"), *chunks]


def _along_rows(f: np.ufunc, data: NDArray[Any]) -> NDArray[Any]:
    """Reduction of (n, k) rows to one: of long rows first, which is many times faster."""
    whole = len(data) // 1024 * 1024
    parts = [data[whole:]]
    if whole:
        parts.append(f.reduce(data[:whole].reshape(-1, 1024 * data.shape[1]), axis=0).reshape(1024, -1))
    return np.asarray(f.reduce(np.concatenate(parts), axis=0))
