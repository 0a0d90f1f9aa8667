"""Fields: a grid of a file, with a place of its own."""

from __future__ import annotations

import os
import re
from dataclasses import dataclass
from typing import Any

import numpy as np
from pxr import Sdf, Usd, UsdGeom, UsdVol

from ..claim import Claim
from ..context import Context
from ..registry import converts
from ..report import InputError
from ..scene import Matrix
from ..shading import anchored
from ..xform import matrix_of
from . import files

_PROPERTIES = ("fieldName", "fieldIndex", "fieldDataType", "fieldClass", "vectorDataRoleHint", "filePath", "fieldPurpose")
_TYPES = {
    "half": {"float"}, "float": {"float"}, "double": {"double"}, "int": {"int32"}, "int64": {"int64"},
    "half3": {"vec3s"}, "float3": {"vec3s"}, "double3": {"vec3d"}, "int3": {"vec3i"}, "bool": {"bool"}, "mask": {"mask"},
}  # fmt: skip


@dataclass(frozen=True)
class Field:
    """A grid that a volume has under some name."""

    name: str
    """The relationship's name, without "field:": what shaders call it."""
    path: str
    """The field prim's path."""
    file: str
    """As the scene names it."""
    grid: str
    matrix: Matrix
    """From the grid's world to the volume's space."""
    info: dict[str, Any] | None
    """What the file says of the grid, if known."""

    @property
    def vector(self) -> bool:
        return self.info is not None and str(self.info["type"]).startswith("vec3")


@converts("OpenVDBAsset", "Field3DAsset")
def field_prim(ctx: Context, claim: Claim) -> None:
    """Read where a volume names it."""
    claim.take(*_PROPERTIES)

    def unused() -> None:
        if (claim.path, "filePath") not in ctx.used:
            ctx.report.note(claim.path, "a field that no volume in the picture has")

    claim.at_end = unused


def read(ctx: Context, claim: Claim, name: str, path: Sdf.Path) -> Field | None:
    """The field ``name`` of a volume; None, and reported, for what is no OpenVDB field."""
    prim = ctx.stage.GetPrimAtPath(path)
    if not prim:
        raise InputError(claim.path, f"field:{name} names <{path}>, which is not there")
    ctx.used.add((str(path), "filePath"))
    kind = str(prim.GetTypeName())
    if kind != "OpenVDBAsset":
        claim.skipped(f"field:{name}", f"{path}: fields of type '{kind}' are not read, only OpenVDBAsset", "the field is missing")
        return None
    asset = UsdVol.OpenVDBAsset(prim)
    file = _file(ctx, prim, asset.GetFilePathAttr())
    grid = str(asset.GetFieldNameAttr().Get(ctx.time) or name)
    index = int(asset.GetFieldIndexAttr().Get(ctx.time) or 0)
    unique, info = files.unique_name(file, str(path), grid, index)
    said = asset.GetFieldDataTypeAttr().Get(ctx.time)
    if info is not None and said and info["type"] not in _TYPES.get(str(said), {info["type"]}):
        ctx.report.approximated(
            path, "fieldDataType", f"says {said}, and the grid '{unique}' holds {info['type']}", "the grid is read as it is"
        )
    return Field(name, str(path), ctx.plain_file(claim, f"field:{name}", file), unique, _place(ctx, claim.prim, prim), info)


def _file(ctx: Context, prim: Usd.Prim, attribute: Usd.Attribute) -> str:
    """The resolved path; of a pattern, that of the frame."""
    asset = attribute.Get(ctx.time)
    where = f"{prim.GetPath()}.filePath"
    if asset is None or not asset.path:
        raise InputError(where, "no file is given at this time")
    if asset.resolvedPath and os.path.exists(asset.resolvedPath):
        return str(asset.resolvedPath)
    if asset.resolvedPath and not os.path.isabs(asset.resolvedPath.split("[")[0]):
        return str(asset.resolvedPath)
    path = anchored(asset.path, attribute)
    if (named := frame_of(path, ctx.time)) != path:
        if os.path.exists(named):
            return named
        raise InputError(where, f"can't find the file '{named}', the frame {_frame(ctx.time)} of '{asset.path}'")
    if asset.resolvedPath:
        return str(asset.resolvedPath)
    raise InputError(where, f"can't find the file '{asset.path}'")


_PATTERN = re.compile(r"(#+)|%0?(\d*)d|\$F(\d*)|<(?:frame|F)(\d*)>|\{frame\}")


def frame_of(path: str, time: Usd.TimeCode) -> str:
    """A pattern's file at a time: ``####``, ``%04d``, ``$F4``, ``<F4>``, ``<frame>`` and ``{frame}`` stand for the frame."""

    def number(match: re.Match[str]) -> str:
        width = len(match[1]) if match[1] else int(match[2] or match[3] or match[4] or 1)
        return str(_frame(time)).zfill(width)

    folder, name = os.path.split(path)
    return os.path.join(folder, _PATTERN.sub(number, name))


def _frame(time: Usd.TimeCode) -> int:
    return 0 if time.IsDefault() or time.IsEarliestTime() else int(np.floor(time.GetValue()))


def _place(ctx: Context, volume: Usd.Prim, field: Usd.Prim) -> Matrix:
    """The field's own transform: below the volume that of all prims between, elsewhere its own alone.

    Where a field stands does not matter to the volumes that share it, so that prims above it do not move it.
    """
    if field.GetPath().HasPrefix(volume.GetPath()):
        matrix = np.eye(4)
        prim = field
        while prim.GetPath() != volume.GetPath():
            matrix = matrix_of(_local(ctx, prim)) @ matrix
            prim = prim.GetParent()
        return matrix
    return matrix_of(_local(ctx, field))


def _local(ctx: Context, prim: Usd.Prim) -> Any:
    xformable = UsdGeom.Xformable(prim)
    return xformable.GetLocalTransformation(ctx.time)
