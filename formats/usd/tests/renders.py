"""Runs the renderer and reads what it measured: for tests that judge pictures."""

from __future__ import annotations

import json
import os
import shutil
import struct
import subprocess
import zlib
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest


def program_or_none() -> str | None:
    """The ``resolvent`` command: ``RESOLVENT_PROGRAM``, that of this repository's build, or that in PATH."""
    built = Path(__file__).resolve().parents[3] / "target" / "release" / "resolvent"
    return os.environ.get("RESOLVENT_PROGRAM") or (str(built) if built.exists() else shutil.which("resolvent"))


def program() -> str:
    """The same, without which there is no test."""
    return program_or_none() or pytest.skip("the resolvent command is not built: cargo build --release")


def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
    return subprocess.run([program(), *map(str, arguments)], capture_output=True, text=True, check=False)


@dataclass(frozen=True)
class Measured:
    """Mean over pixels that all see the same, and its standard error."""

    mean: np.ndarray
    error: np.ndarray

    def agrees(self, expected: Any, tolerance: float = 3e-3) -> None:
        """Within ``tolerance``, with an error small enough to tell."""
        expected = np.asarray(expected, dtype=float)
        scale = np.maximum(np.abs(expected), 1e-3 * np.abs(expected).max())
        off = np.abs(self.mean - expected) / scale
        text = f"measured {self.mean.tolist()} ± {self.error.tolist()}, expected {expected.tolist()}"
        assert (self.error / scale).max() < tolerance / 3, f"too noisy: {text}"
        assert off.max() < tolerance, text
        # And no further off than four standard errors and what numbers in single precision lose.
        assert (off <= 4.0 * self.error / scale + 3e-4).all(), text


def picture(scene: dict[str, Any], folder: Path, name: str = "measure") -> np.ndarray:
    """Renders a scene that stands in ``folder``; (height, width, 3)."""
    file, out = folder / f"{name}.json", folder / f"{name}.exr"
    file.write_text(json.dumps(scene))
    done = run("render", file, "-o", out, "--quiet")
    assert done.returncode == 0, done.stderr
    return read_exr(out)


def measure(scene: dict[str, Any], folder: Path, spp: int = 256, edge: int = 32) -> Measured:
    """Renders with a camera whose pixels all see the same point."""
    scene = {**scene, "film": {"resolution": [edge, edge]}, "sampling": {"spp": spp, "seed": 7}}
    pixels = picture(scene, folder).reshape(-1, 3)
    return Measured(pixels.mean(axis=0), pixels.std(axis=0, ddof=1) / np.sqrt(len(pixels)))


def looking(origin: Any, target: Any, up: Any = (0, 0, 1)) -> dict[str, Any]:
    """A camera that sees a point."""
    return {"type": "perspective", "origin": list(map(float, origin)), "target": list(map(float, target)), "up": list(up), "fov_x_deg": 1e-4}


def read_exr(path: Path) -> np.ndarray:
    """Red, green and blue of an OpenEXR file of one part in scan lines of 32-bit floats, as the renderer writes it."""
    data = path.read_bytes()
    magic, version = struct.unpack_from("<II", data)
    assert magic == 20000630 and version & 0xFFFFFF00 == 0, "an OpenEXR file of one part in scan lines"
    at, header = 8, {}
    while data[at]:
        end = data.index(b"\0", at)
        key, at = data[at:end].decode(), end + 1
        end = data.index(b"\0", at)
        size = struct.unpack_from("<I", data, end + 1)[0]
        header[key] = data[end + 5 : end + 5 + size]
        at = end + 5 + size
    at += 1
    x0, y0, x1, y1 = struct.unpack("<4i", header["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    channels, rest = [], header["channels"]
    while rest[0]:
        name, _, rest = rest.partition(b"\0")
        assert struct.unpack_from("<I", rest)[0] == 2, "32-bit floats"
        channels.append(name.decode())
        rest = rest[16:]
    compression = header["compression"][0]
    lines = {0: 1, 2: 1, 3: 16}[compression]
    out = np.empty((height, len(channels), width), dtype="<f4")
    blocks = -(-height // lines)
    for offset in struct.unpack_from(f"<{blocks}Q", data, at):
        y, size = struct.unpack_from("<iI", data, offset)
        raw = data[offset + 8 : offset + 8 + size]
        rows = min(lines, height - (y - y0))
        full = rows * len(channels) * width * 4
        if compression and size < full:
            coded = np.frombuffer(zlib.decompress(raw), dtype=np.uint8).astype(np.int64)
            # Differences, then the two halves of the bytes in turn.
            coded[1:] -= 128
            plain = (np.cumsum(coded) & 255).astype(np.uint8)
            half = (full + 1) // 2
            raw_bytes = np.empty(full, dtype=np.uint8)
            raw_bytes[0::2], raw_bytes[1::2] = plain[:half], plain[half:]
            raw = raw_bytes.tobytes()
        out[y - y0 : y - y0 + rows] = np.frombuffer(raw, dtype="<f4").reshape(rows, len(channels), width)
    return np.stack([out[:, channels.index(c)] for c in "RGB"], axis=-1).astype(float)


def write_png(path: Path, pixels: np.ndarray) -> None:
    """An RGB image of 8 bits, rows from the top."""
    height, width, _ = pixels.shape
    rows = b"".join(b"\0" + row.astype(np.uint8).tobytes() for row in pixels)

    def chunk(kind: bytes, body: bytes) -> bytes:
        return struct.pack(">I", len(body)) + kind + body + struct.pack(">I", zlib.crc32(kind + body))

    header = struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))
