"""USD stages to Resolvent scenes.

Reading order: :mod:`convert` (what happens), :mod:`traverse` (the walk), :mod:`claim` (one prim), :mod:`registry` (who
converts what), then the converters: geometry, cameras, lights, volumes, materials.
"""

from __future__ import annotations

import hashlib
from importlib import metadata
from pathlib import Path

__version__ = "0.1.0"


def fingerprint() -> str:
    """What a conversion depends on besides stage and options: this package's sources, and the version of usd-core."""
    try:
        usd = metadata.version("usd-core")
    except metadata.PackageNotFoundError:
        # OpenUSD from elsewhere.
        from pxr import Usd

        usd = str(Usd.GetVersion())
    key = hashlib.blake2b(usd.encode(), digest_size=16)
    folder = Path(__file__).parent
    for file in sorted(folder.rglob("*.py")):
        key.update(f"{file.relative_to(folder).as_posix()}\n".encode() + file.read_bytes())
    return f"{__version__}+{key.hexdigest()}"
