"""Volumes: where the grids are, what they are made of, and that they look like the same file rendered directly."""

from __future__ import annotations

import itertools
import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, convert_file
from pxr import Gf, Usd, UsdGeom
from renders import picture, program, run

from resolvent_usd.report import InputError
from resolvent_usd.volumes.fields import frame_of
from resolvent_usd.volumes.optics import planck_luminance

_numbers = itertools.count()
VDB = DATA.parent / "vdb"
FIRE = VDB / "corpus" / "multi_fire.vdb"


@pytest.fixture(autouse=True)
def the_program(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("RESOLVENT_PROGRAM", program())


def field(name: str, grid: str, extra: str = "", file: Path = FIRE) -> str:
    return f'def OpenVDBAsset "{name}" {{\n token fieldName = "{grid}"\n asset filePath = @{file}@\n {extra}\n}}\n'


def stage(folder: Path, body: str, head: str = 'upAxis = "Y"\n metersPerUnit = 1', **options: Any):
    # A file of its own: usd-core keeps layers that were read.
    source = folder / f"stage{next(_numbers)}.usda"
    source.write_text(f"#usda 1.0\n(\n {head}\n)\n{body}")
    return convert_file(source, folder / "stage.json", **options)


def volume(fields: dict[str, str], body: str = "", name: str = "v") -> str:
    rels = "\n".join(f" rel field:{n} = </{name}/{n}>" for n in fields)
    return f'def Volume "{name}" (prepend apiSchemas = ["MaterialBindingAPI"]) {{\n{rels}\n{body}\n{"".join(fields.values())}}}\n'


def bound(shader: str) -> str:
    """A volume material with a shader, and the binding to it."""
    return f'def Material "m" {{\n token outputs:volume.connect = </m/s.outputs:out>\n{shader}\n}}\n'


BIND = " rel material:binding = </m>\n"


def test_all_volumes_of_a_stage(tmp_path: Path) -> None:
    """Axes are swapped, a field is animated, another moved; what is missing is named, with what there is."""
    source = DATA / "own" / "fire_zup.usda"
    with pytest.raises(InputError, match=r"no grid 'no_such_grid'; it has: density \(float\), temperature \(float\), flame"):
        convert_file(source, tmp_path / "out.json", frame=2)
    converted = convert_file(source, tmp_path / "out.json", frame=2, keep_going=True)
    media = converted.scene["media"]
    assert set(media) == {"/World/fire", "/World/animated"}
    cache = UsdGeom.XformCache(2)
    opened = Usd.Stage.Open(str(source))
    for path, medium in media.items():
        world = np.array(cache.GetLocalToWorldTransform(opened.GetPrimAtPath(path))).T
        assert np.abs(np.array(medium.get("transform", np.eye(4))) - world).max() < 1e-12
    assert media["/World/animated"]["params"]["file"].endswith("smoke_000002.vdb")
    assert converted.path(media["/World/fire"]["params"]["file"]).resolve() == FIRE.resolve()
    failed = [x.reason for x in converted.report.losses if x.kind == "failed"]
    assert len(failed) == 2 and any("can't find the file './does_not_exist.vdb'" in x for x in failed)
    assert any("without fields" in x for x in converted.losses("/World/nofields"))
    assert any("motion blur" in x for x in converted.losses("/World/fire"))


def test_a_camera_that_is_placed_sees_volumes(tmp_path: Path) -> None:
    """Even if no extent is authored: the fire lies some ten units from the origin."""
    move = 'double3 xformOp:translate = (10, 0, 0)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
    camera = stage(tmp_path, volume({"density": field("density", "density")}, move)).scene["camera"]
    assert np.allclose(camera["target"], [12.75, -3, 1.875], atol=0.01)


def test_variants_set_the_density(tmp_path: Path) -> None:
    source = DATA / "own" / "cloud_volume.usda"
    for variant, sigma in (("thick", 40), ("thin", 2)):
        options = {"variants": (("/World/sky/cloud", "thickness", variant),)}
        params = convert_file(source, tmp_path / "out.json", **options).scene["media"]["/World/sky/cloud"]["params"]
        assert params["sigma_t"] == [sigma] * 3
        assert np.allclose(params["albedo"], 0.999) and np.isclose(params["phase"]["params"]["g"], 0.85)


def test_places_of_fields(tmp_path: Path) -> None:
    """A field below its volume moves with all prims between; elsewhere it has its own transform alone."""
    move = 'double3 xformOp:translate = (1, 2, 3)\n uniform token[] xformOpOrder = ["xformOp:translate"]'
    inner = f'def Xform "x" {{\n float3 xformOp:scale = (2, 2, 2)\n uniform token[] xformOpOrder = ["xformOp:scale"]\n{field("d", "density", move)}}}\n'
    body = (
        f'def Xform "far" {{\n {move}\n{field("f", "flame", move)}}}\n'
        f'def Volume "v" {{\n rel field:density = </v/x/d>\n rel field:flame = </far/f>\n{inner}}}\n'
    )
    medium = stage(tmp_path, body).scene["media"]["/v"]
    place = np.array(medium["transform"])
    assert np.allclose(place, [[2, 0, 0, 2], [0, 2, 0, 4], [0, 0, 2, 6], [0, 0, 0, 1]])
    flame = np.array(medium["params"]["emission_grid_transform"]).reshape(3, 4)
    # Both together put the flame where its own transform says.
    assert np.allclose((place @ np.vstack([flame, [0, 0, 0, 1]]))[:3], [[1, 0, 0, 1], [0, 1, 0, 2], [0, 0, 1, 3]])


def test_grids_of_one_name_and_of_several_files(tmp_path: Path) -> None:
    fields = {"density": field("density", "density", "int fieldIndex = 1", VDB / "corpus" / "multi_same_name.vdb"), "flame": field("flame", "flame")}
    params = stage(tmp_path, volume(fields)).scene["media"]["/v"]["params"]
    assert params["grid"] == "density[1]" and params["emission_grid_file"].endswith("multi_fire.vdb")
    fields["density"] = fields["density"].replace("fieldIndex = 1", "fieldIndex = 7")
    with pytest.raises(InputError, match="none with index 7"):
        stage(tmp_path, volume(fields))


def test_patterns_of_frames(tmp_path: Path) -> None:
    for pattern in ("s.####.vdb", "s.%04d.vdb", "s.$F4.vdb", "s.<F4>.vdb"):
        assert frame_of(f"/a#b/{pattern}", Usd.TimeCode(12)) == "/a#b/s.0012.vdb"
    assert frame_of("/a/s.{frame}.vdb", Usd.TimeCode(3.7)) == "/a/s.3.vdb"
    (tmp_path / "fire.0012.vdb").write_bytes(FIRE.read_bytes())
    fields = {"density": field("density", "density", "", tmp_path / "fire.####.vdb")}
    params = stage(tmp_path, volume(fields), frame=12).scene["media"]["/v"]["params"]
    assert params["file"].endswith("fire.0012.vdb")
    with pytest.raises(InputError, match="fire.0013.vdb"):
        stage(tmp_path, volume(fields), frame=13)


def test_karma_reads_fields_times_constants(tmp_path: Path) -> None:
    shader = """
 def Shader "s" {
  uniform token info:id = "kma_volume"
  color3f inputs:scattering.connect = </m/times.outputs:out>
  color3f inputs:absorption = (0.5, 1, 1.5)
  float inputs:anisotropy = 0.7
  float inputs:secondary_anisotropy = -0.2
  float inputs:secondary_mix = 0.25
  token outputs:out
 }
 def Shader "times" {
  uniform token info:id = "ND_multiply_color3FA"
  color3f inputs:in1 = (2, 3, 4)
  float inputs:in2.connect = </m/read.outputs:out>
  color3f outputs:out
 }
 def Shader "read" {
  uniform token info:id = "ND_geompropvalue_float"
  string inputs:geomprop = "density"
  float outputs:out
 }
"""
    converted = stage(tmp_path, volume({"density": field("density", "density")}, BIND) + bound(shader))
    params = converted.scene["media"]["/v"]["params"]
    assert np.allclose(params["sigma_t"], [2.5, 4, 5.5])
    assert np.allclose(params["albedo"], np.array([2, 3, 4]) / [2.5, 4, 5.5])
    assert params["phase"] == {"plugin": "two-lobe-hg", "params": {"g1": pytest.approx(0.7), "g2": pytest.approx(-0.2), "weight": 0.75}}
    # A constant absorption has no field of its own: it is said that it takes the scattering's.
    assert any("different fields" in x for x in converted.losses("/m/s"))


def test_arnold(tmp_path: Path) -> None:
    shader = """
 def Shader "s" {
  uniform token info:id = "arnold:standard_volume"
  float inputs:density = 3
  float inputs:scatter = 0.5
  color3f inputs:scatter_color = (1, 0.8, 0.6)
  float inputs:scatter_anisotropy = 0.3
  color3f inputs:transparent = (0.5, 0.25, 0.125)
  string inputs:temperature_channel = "temperature"
  float inputs:blackbody_kelvin = 2500
  float inputs:blackbody_intensity = 2
  token outputs:out
 }
"""
    fields = {n: field(n, n) for n in ("density", "temperature")}
    converted = stage(tmp_path, volume(fields, BIND) + bound(shader))
    params = converted.scene["media"]["/v"]["params"]
    assert np.allclose(params["sigma_t"], 3 * np.log(2) * np.array([1, 2, 3]))
    assert np.allclose(params["albedo"], [0.5, 0.4, 0.3])
    assert params["temperature_grid"] == "temperature" and params["temperature_scale"] == 2500
    power = 5.670374419e-8 * 2500**4 / np.pi * 1e-6
    assert np.isclose(params["emission_scale"] * planck_luminance(2500), 2 * power)
    assert any("Planck" in x for x in converted.losses("/m/s"))


def test_luminance_of_black_bodies() -> None:
    """The sun's surface: 1.9e9 cd/m² at 5772 K, as tables of black bodies have it."""
    assert abs(683 * planck_luminance(5772) / 1.876e9 - 1) < 0.02


def test_cycles(tmp_path: Path) -> None:
    shader = """
 def Shader "s" {
  uniform token info:id = "cycles:principled_volume"
  color3f inputs:color = (0.8, 0.5, 0.2)
  color3f inputs:absorption_color = (0, 0.25, 1)
  float inputs:density = 2
  float inputs:anisotropy = -0.1
  float inputs:emission_strength = 3
  color3f inputs:emission_color.connect = </m/flame.outputs:out>
  token outputs:out
 }
 def Shader "flame" {
  uniform token info:id = "ND_geompropvalue_float"
  string inputs:geomprop = "flame"
  float outputs:out
 }
"""
    fields = {n: field(n, n) for n in ("density", "flame")}
    params = stage(tmp_path, volume(fields, BIND) + bound(shader)).scene["media"]["/v"]["params"]
    scatter = np.array([0.8, 0.5, 0.2])
    total = scatter + (1 - scatter) * (1 - np.sqrt([0, 0.25, 1]))
    assert np.allclose(params["sigma_t"], 2 * total) and np.allclose(params["albedo"], scatter / total)
    assert params["emission_grid"] == "flame" and params["emission"] == [3, 3, 3]


def test_unknown_shaders_are_named(tmp_path: Path) -> None:
    shader = ' def Shader "s" {\n  uniform token info:id = "smoke_of_someone"\n  token outputs:out\n }\n'
    converted = stage(tmp_path, volume({"density": field("density", "density")}, BIND) + bound(shader))
    assert any("smoke_of_someone" in x for x in converted.losses("/m/s"))
    assert converted.scene["media"]["/v"]["params"]["sigma_t"] == [1, 1, 1]


# Pictures


def shot(folder: Path, name: str, scene: dict[str, Any], spp: int = 64) -> Path:
    scene = {**scene, "film": {"resolution": [48, 32], "aovs": ["variance"]}, "sampling": {"spp": spp, "seed": 3}}
    file = folder / f"{name}.json"
    file.write_text(json.dumps(scene))
    done = run("render", file, "-o", folder / f"{name}.exr", "--quiet")
    assert done.returncode == 0, done.stderr
    return folder / f"{name}.exr"


def same(a: Path, b: Path) -> None:
    """The z-test of ``resolvent compare`` finds no difference."""
    done = run("compare", a, b, "--json", "--fail")
    found = json.loads(done.stdout)
    assert done.returncode == 0, found



def cloud(unit: float, up: str) -> str:
    """One shot in several units and axes: the root turns and stretches everything, densities shrink as lengths grow."""
    length = 1.0 / unit
    turn = Gf.Matrix4d(1) if up == "Y" else Gf.Matrix4d(Gf.Matrix3d(1, 0, 0, 0, 0, 1, 0, -1, 0), Gf.Vec3d(0))
    matrix = str(turn * Gf.Matrix4d().SetScale(length))
    return f"""
def Xform "root" {{
 matrix4d xformOp:transform = {matrix}
 uniform token[] xformOpOrder = ["xformOp:transform"]
 def Camera "cam" {{
  float horizontalAperture = 36
  float verticalAperture = 24
  float focalLength = 40
  double3 xformOp:translate = (-3, 6, 28)
  uniform token[] xformOpOrder = ["xformOp:translate"]
 }}
 def DistantLight "sun" {{
  float inputs:angle = 1
  bool inputs:normalize = 1
  float inputs:intensity = 3
  float3 xformOp:rotateXYZ = (-40, -60, 0)
  uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]
 }}
 def DomeLight "dome" {{
  color3f inputs:color = (0.2, 0.3, 0.5)
 }}
 def Volume "cloud" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
  rel field:density = </root/cloud/d>
  rel material:binding = </m>
  float primvars:densityScale = {4 * unit!r}
  double3 xformOp:translate = (1, 0, 2)
  float3 xformOp:rotateXYZ = (10, 20, 30)
  uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"]
  {field("d", "density", "", VDB / "cloud_s.vdb")}
 }}
}}
def Material "m" {{
 token outputs:volume.connect = </m/s.outputs:out>
 def Shader "s" {{
  uniform token info:id = "ND_volume"
  color3f inputs:scattering_color = (0.99, 0.98, 0.95)
  float inputs:anisotropy = 0.6
  token outputs:out
 }}
}}
"""


def converted_cloud(folder: Path, unit: float, up: str) -> dict[str, Any]:
    return stage(folder, cloud(unit, up), f'upAxis = "{up}"\n metersPerUnit = {unit}').scene


def test_a_volume_looks_like_its_file(tmp_path: Path) -> None:
    """The same grid, placed by a matrix that usd-core computes, gives the same picture."""
    scene = converted_cloud(tmp_path, 1.0, "Y")
    direct = json.loads(json.dumps(scene))
    opened = Usd.Stage.Open(str(next(tmp_path.glob("stage*.usda"))))
    place = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(opened.GetPrimAtPath("/root/cloud"))).T
    phase = {"plugin": "hg", "params": {"g": 0.6}}
    params = {"file": str(VDB / "cloud_s.vdb"), "grid": "density", "sigma_t": 4, "albedo": [0.99, 0.98, 0.95], "phase": phase}
    direct["media"] = {"cloud": {"plugin": "vdb", "transform": place.tolist(), "params": params}}
    direct["sampling"] = {"seed": 99}
    a = shot(tmp_path, "a", scene)
    direct_file = shot(tmp_path, "b", direct)
    same(a, direct_file)
    # Not because both are black.
    assert picture({**scene, "film": {"resolution": [12, 8]}, "sampling": {"spp": 4}}, tmp_path).mean() > 0.05


def test_units_and_axes(tmp_path: Path) -> None:
    """Metres and centimetres, Y up and Z up: one picture."""
    shots = {}
    for unit, up in ((1.0, "Y"), (0.01, "Y"), (1.0, "Z"), (0.01, "Z")):
        scene = converted_cloud(tmp_path, unit, up)
        assert scene["units"]["meters_per_unit"] == unit
        shots[unit, up] = shot(tmp_path, f"{unit}{up}", scene)
    first, *others = shots.values()
    for other in others:
        same(first, other)
