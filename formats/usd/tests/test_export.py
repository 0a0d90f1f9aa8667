"""A scene that goes to USD and comes back gives the same picture, or the report says why not."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, convert_file
from pxr import Usd, UsdGeom
from renders import run, write_png

from resolvent_usd.export import export
from resolvent_usd.export.stage import matrix
from resolvent_usd.report import InputError, Report


def there_and_back(scene: dict[str, Any], folder: Path) -> tuple[dict[str, Any], Report]:
    """The scene after both ways; ``folder`` has its files."""
    (folder / "scene.json").write_text(json.dumps(scene))
    report = Report()
    export(folder / "scene.json", folder / "scene.usda", report)
    return convert_file(folder / "scene.usda", folder / "back.json").scene, report


def same_picture(scene: dict[str, Any], back: dict[str, Any], folder: Path, spp: int = 64) -> None:
    shots = []
    for name, s, seed in (("first", scene, 1), ("second", back, 2)):
        film = {**s.get("film", {}), "resolution": [48, 32], "aovs": ["variance"]}
        (folder / f"{name}.json").write_text(json.dumps({**s, "film": film, "sampling": {"spp": spp, "seed": seed}}))
        done = run("render", folder / f"{name}.json", "-o", folder / f"{name}.exr", "--quiet")
        assert done.returncode == 0, done.stderr
        shots.append(folder / f"{name}.exr")
    done = run("compare", *shots, "--fail", "--json")
    assert done.returncode == 0, done.stdout


CAMERA = {"type": "perspective", "origin": [0, 2, 9], "target": [0, 0.8, 0], "fov_x_deg": 40, "lens_radius": 0.1, "shift": [0.05, -0.02], "exposure": 0.5}
FLOOR = {"type": "rectangle", "corner": [-6, 0, 6], "edge_u": [12, 0, 0], "edge_v": [0, 0, -12], "material": "floor"}


def scene(**keys: Any) -> dict[str, Any]:
    floor = {"plugin": "diffuse", "params": {"reflectance": [0.5, 0.4, 0.3]}}
    out: dict[str, Any] = {"resolvent": 1, "units": {"meters_per_unit": 0.1}, "camera": CAMERA, "film": {"resolution": [48, 32]}}
    out |= {"materials": {"floor": floor}, "shapes": [FLOOR], "lights": [{"type": "environment", "radiance": [0.3, 0.4, 0.5]}]}
    for key, value in keys.items():
        if isinstance(value, dict):
            out[key] = {**out.get(key, {}), **value}
        else:
            out[key] = [*out.get(key, []), *value]
    return out


def test_lights(tmp_path: Path) -> None:
    """Every light whose counterpart UsdLux has."""
    lights = [
        {"type": "distant", "to_light": [1, 2, 0.5], "irradiance": [1, 0.9, 0.7], "angle_deg": 3},
        {"type": "point", "position": [-2, 1, 2], "intensity": [3, 2, 1]},
        {"type": "rectangle", "corner": [1, 0.1, -1], "edge_u": [0, 2, 0], "edge_v": [0.5, 0, 1.5], "radiance": 2, "two_sided": True},
    ]
    shaping = {"axis": [0.2, -1, 0.1], "angle_deg": 80, "softness": 0.4, "focus": 2, "focus_tint": [0.2, 0, 0]}
    shapes = [
        {"type": "sphere", "center": [-1, 2, 0], "radius": 0.2, "emission": [20, 15, 10], "shaping": shaping},
        {"type": "disk", "center": [0.5, 2.5, 0], "normal": [0.2, -1, 0.1], "radius": 0.4, "emission": 5, "shaping": shaping},
        {"type": "cylinder", "base": [-2, 0.5, -1], "axis": [1, 0.5, 0.2], "radius": 0.1, "emission": [0.5, 2, 4]},
    ]
    first = scene(lights=lights, shapes=shapes)
    back, report = there_and_back(first, tmp_path)
    assert report.losses == []
    same_picture(first, back, tmp_path)
    assert back["units"]["meters_per_unit"] == pytest.approx(0.1)


def test_meshes_materials_and_instances(tmp_path: Path) -> None:
    write_png(tmp_path / "t.png", np.array([[[255, 40, 0], [0, 255, 0]], [[0, 60, 255], [200, 200, 200]]]))
    tetrahedron = {"type": "mesh", "positions": [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], "indices": [[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]]}
    shapes = [
        {**tetrahedron, "transform": [{"scale": [1, 1.5, 1]}, {"rotate_deg": {"axis": [0, 1, 0], "angle": 40}}, {"translate": [-2, 0, 0]}], "material": "gold"},
        {"type": "sphere", "center": [1.5, 1, 0], "radius": 0.8, "material": "coated"},
        {"type": "rectangle", "corner": [-1, 0.2, -2], "edge_u": [2, 0, 0], "edge_v": [0, 2, 0], "material": "picture"},
    ]
    materials = {
        "gold": {"plugin": "principled", "params": {"base_color": [0.9, 0.6, 0.2], "metallic": 1, "roughness": 0.3}},
        "coated": {"plugin": "principled", "params": {"base_color": [0.1, 0.2, 0.6], "roughness": 0.6, "clearcoat": 0.8, "clearcoat_roughness": 0.1}},
        "picture": {"plugin": "principled", "params": {"base_color": {"texture": "t"}, "roughness": 0.7}},
    }
    textures = {"t": {"file": "t.png", "wrap": "clamp", "uv_transform": {"scale": [2, 1], "rotation_deg": 10, "offset": [0.1, 0]}}}
    instances = [{"prototype": "stone", "transform": [{"scale": [1, -0.5, 1.5]}, {"translate": [x, 0.6, 1.5]}]} for x in (-1, 0, 1)]
    stone = [{**tetrahedron, "material": "gold"}, {"type": "sphere", "center": [0, 0, 0], "radius": 0.3, "material": "coated"}]
    first = scene(shapes=shapes, materials=materials, textures=textures, instances=instances, prototypes={"stone": stone})
    first["lights"].append({"type": "distant", "to_light": [1, 2, 1.5], "irradiance": 2, "angle_deg": 5})
    back, report = there_and_back(first, tmp_path)
    assert report.losses == []
    same_picture(first, back, tmp_path)
    assert any(len(v) == 2 for v in back["prototypes"].values()) or len(back["instances"]) >= 3


def test_volumes(tmp_path: Path) -> None:
    """Coloured extinction, an emission grid of another file, two lobes."""
    vdb = DATA.parent / "vdb"
    params = {
        "file": str(vdb / "cloud_s.vdb"),
        "sigma_t": [2, 3, 4],
        "density_scale": 1.5,
        "albedo": [0.9, 0.8, 0.95],
        "phase": {"plugin": "two-lobe-hg", "params": {"g1": 0.6, "g2": -0.3, "weight": 0.8}},
    }
    media = {"cloud": {"plugin": "vdb", "params": params, "transform": [{"scale": 0.4}, {"translate": [2, 0.5, 2]}]}}
    first = scene(media=media)
    back, report = there_and_back(first, tmp_path)
    assert report.losses == []
    same_picture(first, back, tmp_path)


def test_a_stage_goes_round(tmp_path: Path) -> None:
    """USD, scene, USD, scene: the lights of the test data arrive unchanged."""
    first = convert_file(DATA / "own" / "lights_all.usda", tmp_path / "scene.json").scene
    back, report = there_and_back(first, tmp_path)
    assert [x for x in report.losses] == []
    lit = [[s for s in x["shapes"] if "emission" in s] for x in (first, back)]
    for a, b in zip(*lit, strict=True):
        assert a["type"] == b["type"] and np.allclose(a["emission"], b["emission"], rtol=1e-6)
    for a, b in zip(first["lights"], back["lights"], strict=True):
        assert a["type"] == b["type"]
        for key in ("irradiance", "radiance", "intensity", "to_light", "position"):
            assert key not in a or np.allclose(a[key], b[key], rtol=1e-5, atol=1e-7)


def test_cameras(tmp_path: Path) -> None:
    first = scene()
    first["camera"] = {"type": "orthographic", "transform": [{"translate": [0, 1, 5]}], "width": 4, "shift": [0.1, 0.2]}
    back = there_and_back(first, tmp_path)[0]["camera"]
    assert back["type"] == "orthographic" and back["width"] == pytest.approx(4) and back["shift"] == pytest.approx([0.1, 0.2])
    back = there_and_back(scene(), tmp_path)[0]["camera"]
    distance = np.linalg.norm([0, 1.2, 9])
    assert back["fov_x_deg"] == pytest.approx(40) and back["lens_radius"] == pytest.approx(0.1) and back["focus_distance"] == pytest.approx(distance)
    assert back["exposure"] == pytest.approx(0.5) and back["shift"] == pytest.approx([0.05, -0.02])


def test_what_usd_has_no_words_for(tmp_path: Path) -> None:
    first = scene(media={"fog": {"plugin": "homogeneous", "params": {"sigma_t": 1, "bounds": [0, 0, 0, 1, 1, 1]}}})
    first["lights"].append({"type": "sun_sky", "elevation_deg": 30})
    first["shapes"].append({"type": "sphere", "center": [0, 1, 0], "radius": 1, "interior": "fog", "material": "floor"})
    report = there_and_back(first, tmp_path)[1]
    said = {(x.path, x.what) for x in report.losses}
    assert {("/media/fog", "homogeneous"), ("/lights/1", "sun_sky"), ("/shapes/1", "interior")} <= said
    (tmp_path / "none.json").write_text("[1, 2]")
    with pytest.raises(InputError, match="no Resolvent scene"):
        export(tmp_path / "none.json", tmp_path / "x.usda", Report())


def test_transforms() -> None:
    """The first operation acts first."""
    m = matrix([{"scale": [2, 1, 1]}, {"rotate_deg": {"axis": [0, 0, 1], "angle": 90}}, {"translate": [1, 2, 3]}])
    assert np.allclose(m @ [1, 0, 0, 1], [1, 4, 3, 1])


def test_the_stage_itself(tmp_path: Path) -> None:
    there_and_back(scene(), tmp_path)
    stage = Usd.Stage.Open(str(tmp_path / "scene.usda"))
    assert UsdGeom.GetStageUpAxis(stage) == "Y" and str(stage.GetDefaultPrim().GetPath()) == "/World"


@pytest.mark.parametrize(
    "name", ["own/assembly.usda", "own/cloud_volume.usda", "openusd/Instancing/instancedCubes.usda", "openusd/PreviewSurface/testPreviewSurfaceTransform2d.usda"]
)
def test_stages_go_round_with_equal_renders(tmp_path: Path, name: str) -> None:
    """USD, scene, USD, scene: one picture, and nothing is lost on the way back."""
    first = convert_file(DATA / name, tmp_path / "scene.json", keep_going=True).scene
    lights = [{"type": "environment", "radiance": [0.5, 0.6, 0.7]}, {"type": "distant", "to_light": [1, 2, 1.5], "irradiance": 1, "angle_deg": 3}]
    first["lights"] = first.get("lights", []) or lights
    back, report = there_and_back(first, tmp_path)
    assert report.losses == []
    same_picture(first, back, tmp_path, spp=32)
