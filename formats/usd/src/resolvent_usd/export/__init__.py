"""The way back: a Resolvent scene as a USD stage.

Cameras, lights, meshes, spheres, volumes and preview materials come back as equal pictures; the rest is reported.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from pxr import Sdf, Usd, UsdGeom

from ..report import InputError, Report
from . import camera, lights, media, shapes
from .stage import Target


def export(scene_file: Path, stage_file: Path, report: Report) -> None:
    """Writes the scene as a stage; what it has no words for goes to the report."""
    try:
        scene: dict[str, Any] = json.loads(scene_file.read_text(encoding="utf-8"))
    except ValueError as error:
        raise InputError(scene_file, f"is no JSON: {error}") from None
    if not isinstance(scene, dict) or "resolvent" not in scene:
        raise InputError(scene_file, "is no Resolvent scene")
    if stage_file.exists():
        stage_file.unlink()
    layer = Sdf.Layer.Find(str(stage_file))
    if layer:
        layer.Clear()
    stage = Usd.Stage.CreateNew(str(stage_file)) if not layer else Usd.Stage.Open(layer)
    target = Target(stage, scene, scene_file, stage_file, report)
    UsdGeom.SetStageUpAxis(stage, UsdGeom.Tokens.y)
    UsdGeom.SetStageMetersPerUnit(stage, float(scene.get("units", {}).get("meters_per_unit", 1.0)))
    root = UsdGeom.Xform.Define(stage, "/World")
    stage.SetDefaultPrim(root.GetPrim())
    camera.write(target)
    lights.write(target)
    shapes.write(target)
    media.write(target)
    for key in ("integrator", "sampling"):
        if scene.get(key):
            report.skipped(f"/{key}", key, "USD has no words for it", "the renderer's own settings are used")
    stage.GetRootLayer().Save()
