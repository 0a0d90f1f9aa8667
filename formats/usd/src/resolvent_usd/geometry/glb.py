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


def write(t: Triangles) -> bytes:
    """The bytes of the .glb file."""
    chunks: list[bytes] = []
    views: list[dict[str, Any]] = []
    accessors: list[dict[str, Any]] = []

    def add(array: NDArray[Any], kind: str, component: int, target: int, bounds: bool = False) -> int:
        data = np.ascontiguousarray(array, dtype="<u4" if component == _U32 else "<f4")
        views.append({"buffer": 0, "byteOffset": sum(map(len, chunks)), "byteLength": data.nbytes, "target": target})
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1, "componentType": component, "count": len(data), "type": kind,
        }  # fmt: skip
        if bounds:
            accessor["min"], accessor["max"] = data.min(axis=0).tolist(), data.max(axis=0).tolist()
        accessors.append(accessor)
        chunks.append(data.tobytes())
        return len(accessors) - 1

    attributes = {"POSITION": add(t.positions, "VEC3", _F32, _ARRAY_BUFFER, bounds=True)}
    if t.normals is not None:
        attributes["NORMAL"] = add(t.normals, "VEC3", _F32, _ARRAY_BUFFER)
    if t.uvs is not None:
        # glTF's v points down.
        flipped = np.stack([t.uvs[:, 0], 1.0 - t.uvs[:, 1].astype(float)], axis=1)
        attributes["TEXCOORD_0"] = add(flipped, "VEC2", _F32, _ARRAY_BUFFER)
    if t.colors is not None:
        attributes["COLOR_0"] = add(t.colors, "VEC4", _F32, _ARRAY_BUFFER)
    indices = add(t.indices.reshape(-1), "SCALAR", _U32, _ELEMENT_ARRAY_BUFFER)
    binary = b"".join(chunks)
    root = {
        "asset": {"version": "2.0", "generator": "resolvent_usd"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}],
        "meshes": [{"primitives": [{"attributes": attributes, "indices": indices}]}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(binary)}],
    }
    text = json.dumps(root, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    total = 12 + 8 + len(text) + 8 + len(binary)
    header = struct.pack("<4sII", b"glTF", 2, total)
    json_chunk = struct.pack("<I4s", len(text), b"JSON") + text
    return header + json_chunk + struct.pack("<I4s", len(binary), b"BIN\0") + binary
