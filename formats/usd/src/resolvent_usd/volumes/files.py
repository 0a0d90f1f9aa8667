"""What OpenVDB files contain, as the ``resolvent`` command tells it."""

from __future__ import annotations

import functools
import json
import os
import shutil
import subprocess
from typing import Any

from ..report import InputError

PROGRAM = "RESOLVENT_PROGRAM"
"""Environment variable with the path of the ``resolvent`` command; without it, it is sought in PATH."""


def grids(path: str, prim: str) -> list[dict[str, Any]] | None:
    """The grids of a file, as ``resolvent info --json`` lists them; None if the command is not there."""
    program = os.environ.get(PROGRAM) or shutil.which("resolvent")
    if program is None:
        return None
    answer = _ask(program, path, os.stat(path).st_mtime_ns)
    if isinstance(answer, str):
        raise InputError(prim, answer)
    return answer


@functools.lru_cache(maxsize=256)
def _ask(program: str, path: str, changed: int) -> list[dict[str, Any]] | str:
    del changed  # Only tells one version of the file from the next.
    run = subprocess.run([program, "info", "--json", path], capture_output=True, text=True, check=False)
    if run.returncode != 0:
        lines = run.stderr.strip().splitlines()
        return lines[-1].removeprefix("error: ") if lines else f"'{path}' can't be read"
    found = json.loads(run.stdout).get("grids")
    return found if isinstance(found, list) else f"'{path}' is no OpenVDB file"


def unique_name(path: str, prim: str, name: str, index: int) -> tuple[str, dict[str, Any] | None]:
    """The name that tells a grid from others of its name, and what is known of it.

    Without the ``resolvent`` command the grid's existence is not checked: rendering will do that.
    """
    known = grids(path, prim)
    if known is None:
        return (name if index == 0 else f"{name}[{index}]"), None
    same = [g for g in known if g["name"] == name] or [g for g in known if g["unique_name"] == name]
    if 0 <= index < len(same):
        return str(same[index]["unique_name"]), same[index]
    listed = ", ".join(f"{g['unique_name']} ({g['type']})" for g in known) or "no grids"
    if same:
        raise InputError(prim, f"'{path}' has {len(same)} grids '{name}', none with index {index}; it has: {listed}")
    raise InputError(prim, f"'{path}' has no grid '{name}'; it has: {listed}")
