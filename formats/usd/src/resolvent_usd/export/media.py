"""Media: VDB grids as UsdVol volumes with a Karma volume shader."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Sdf, UsdShade, UsdVol

from ..scene import Json
from .stage import Target, color, matrix, place

_KNOWN = {"file", "grid", "sigma_t", "albedo", "density_scale", "density_offset", "emission_grid", "emission_grid_file", "emission", "phase"}


def write(target: Target) -> None:
    """All media of the scene."""
    for name, medium in target.scene.get("media", {}).items():
        if medium.get("plugin") != "vdb":
            target.report.skipped(f"/media/{name}", str(medium.get("plugin")), "USD has volumes of files alone", "it is not in the stage")
            continue
        _volume(target, name, medium.get("params", {}), matrix(medium.get("transform")))


def _volume(target: Target, name: str, p: Json, to_world: Any) -> None:
    where = f"/media/{name}"
    for key in sorted(set(p) - _KNOWN):
        target.report.skipped(where, key, "no volume shader that is written has it", "no effect in the stage")
    if float(p.get("density_offset", 0.0)) != 0.0:
        target.report.skipped(where, "density_offset", "no volume shader that is written has it", "the density is not raised")
    volume = UsdVol.Volume.Define(target.stage, target.path(name))
    place(volume, to_world)
    _field(target, volume, "density", p["file"], p.get("grid", "density"))
    material = UsdShade.Material.Define(target.stage, target.path(f"{name}_look"))
    UsdShade.MaterialBindingAPI.Apply(volume.GetPrim()).Bind(material)
    shader = UsdShade.Shader.Define(target.stage, material.GetPath().AppendChild("volume"))
    shader.CreateIdAttr("kma_volume")
    material.CreateVolumeOutput().ConnectToSource(shader.CreateOutput("out", Sdf.ValueTypeNames.Token))
    total = np.array(color(p.get("sigma_t", 1.0))) * float(p.get("density_scale", 1.0))
    albedo = np.array(color(p.get("albedo", 1.0)))
    _times_field(target, material, shader, "scattering", total * albedo, "density")
    if (albedo < 1.0).any():
        _times_field(target, material, shader, "absorption", total * (1.0 - albedo), "density")
    if "emission_grid" in p:
        _field(target, volume, "flame", str(p.get("emission_grid_file", p["file"])), str(p["emission_grid"]))
        _times_field(target, material, shader, "emission", np.array(color(p.get("emission", 1.0))), "flame")
    _phase(target, where, shader, p.get("phase"))


def _field(target: Target, volume: UsdVol.Volume, name: str, file: str, grid: str) -> None:
    path = volume.GetPath().AppendChild(name)
    asset = UsdVol.OpenVDBAsset.Define(target.stage, path)
    asset.CreateFilePathAttr(target.asset(file))
    plain, _, index = grid.rstrip("]").partition("[")
    asset.CreateFieldNameAttr(plain)
    if index.isdigit():
        asset.CreateFieldIndexAttr(int(index))
    volume.CreateFieldRelationship(name, path)


def _times_field(target: Target, material: UsdShade.Material, shader: UsdShade.Shader, name: str, factor: Any, field: str) -> None:
    """``factor`` times a field, as MaterialX writes it."""
    read_path = material.GetPath().AppendChild(f"read_{field}")
    read = UsdShade.Shader.Define(target.stage, read_path)
    read.CreateIdAttr("ND_geompropvalue_float")
    read.CreateInput("geomprop", Sdf.ValueTypeNames.String).Set(field)
    times = UsdShade.Shader.Define(target.stage, material.GetPath().AppendChild(f"{name}_times_{field}"))
    times.CreateIdAttr("ND_multiply_color3FA")
    times.CreateInput("in1", Sdf.ValueTypeNames.Color3f).Set(color(factor))
    times.CreateInput("in2", Sdf.ValueTypeNames.Float).ConnectToSource(read.CreateOutput("out", Sdf.ValueTypeNames.Float))
    shader.CreateInput(name, Sdf.ValueTypeNames.Color3f).ConnectToSource(times.CreateOutput("out", Sdf.ValueTypeNames.Color3f))


def _phase(target: Target, where: str, shader: UsdShade.Shader, phase: Any) -> None:
    if phase is None:
        return
    name = phase if isinstance(phase, str) else phase.get("plugin")
    params = {} if isinstance(phase, str) else phase.get("params", {})
    values: dict[str, float] = {}
    if name == "hg":
        values = {"anisotropy": float(params.get("g", 0.0))}
    elif name == "two-lobe-hg":
        g1, g2, weight = params.get("g1", 0.85), params.get("g2", -0.3), params.get("weight", 0.9)
        values = {"anisotropy": float(g1), "secondary_anisotropy": float(g2), "secondary_mix": 1.0 - float(weight)}
    elif name != "isotropic":
        target.report.skipped(where, "phase", f"no volume shader that is written has the phase function '{name}'", "it is isotropic")
    for key, value in values.items():
        shader.CreateInput(key, Sdf.ValueTypeNames.Float).Set(value)


