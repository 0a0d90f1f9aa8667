"""The command: frames, sequences, variants, purposes, cameras, render settings."""

from __future__ import annotations

import hashlib
import json
import math
from pathlib import Path

import numpy as np
import pytest
from conftest import DATA
from pxr import Usd, UsdGeom
from resolvent_usd.cli import main, scene_files

MOVING = """#usda 1.0
(
    startTimeCode = 1
    endTimeCode = 5
    timeCodesPerSecond = 24
)
def Sphere "s"
{
    double radius.timeSamples = { 1: 1, 5: 3 }
    double3 xformOp:translate.timeSamples = { 1: (0, 0, 0), 3: (4, 0, 0) }
    uniform token[] xformOpOrder = ["xformOp:translate"]
}
"""


def sphere(path: Path) -> tuple[float, float]:
    (shape,) = json.loads(path.read_text())["shapes"]
    return shape["center"][0], shape["radius"]


def test_frames(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text(MOVING)
    for flags, expected in (([], (0, 1)), (["--frame", "2"], (2, 1.5)), (["--frame=2.5"], (3, 1.75)), (["--frame=99"], (4, 3))):
        assert main([str(stage), "-o", str(tmp_path / "one.json"), *flags]) == 0
        assert sphere(tmp_path / "one.json") == pytest.approx(expected)
    capsys.readouterr()
    assert main([str(stage), "-o", str(tmp_path / "shot.json"), "--frames", "1-5:2"]) == 0
    names = [Path(line).name for line in capsys.readouterr().out.splitlines()]
    assert names == ["shot.0001.json", "shot.0003.json", "shot.0005.json"]
    assert [sphere(tmp_path / n) for n in names] == [(0, 1), (4, 2), (4, 3)]
    assert main([str(stage), "-o", str(tmp_path / "f##.json"), "--frames", "4-4"]) == 0
    assert (tmp_path / "f04.json").exists()
    # As resolvent render names its pictures.
    for frame, name in ((-5, "shot.-005.json"), (2.5, "shot.0002.5.json"), (0.1 + 0.2, "shot.0000.3.json"), (1e6, "shot.1000000.json")):
        assert scene_files(Path("shot.json"), [frame]) == [Path(name)]


def test_wrong_usage(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = DATA / "own" / "assembly.usda"
    for flags, words in (
        (["--frames", "5"], "first-last"), (["--frames", "5-1"], "no frames"), (["--variant", "x"], "/Prim{set=selection}"),
        (["--camera", "x y"], "no prim path"), (["--subdivision", "9"], "invalid choice"),
    ):  # fmt: skip
        with pytest.raises(SystemExit) as end:
            main([str(stage), "-o", str(tmp_path / "x.json"), *flags])
        assert end.value.code == 2 and words in capsys.readouterr().err
    for flags, words in (
        (["--variant", "/Nope{lod=low}"], "/Nope"), (["--variant", "/World{lod=low}"], "has no variant set 'lod'"),
        (["--camera", "/World"], "names no camera"), (["--render-settings", "/World"], "names no RenderSettings"),
    ):  # fmt: skip
        assert main([str(stage), "-o", str(tmp_path / "x.json"), *flags]) == 2
        assert words in capsys.readouterr().err


VARIANTS = """#usda 1.0
def Xform "a" (
    variants = { string size = "small" }
    prepend variantSets = "size"
)
{
    variantSet "size" = {
        "small" {
            def Sphere "s" {
                double radius = 1
            }
        }
        "large" {
            def Sphere "s" {
                double radius = 5
            }
        }
    }
}
"""


def test_variants(tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    stage.write_text(VARIANTS)
    assert main([str(stage), "-o", str(tmp_path / "x.json")]) == 0
    assert sphere(tmp_path / "x.json")[1] == 1
    assert main([str(stage), "-o", str(tmp_path / "x.json"), "--variant", "/a{size=large}"]) == 0
    assert sphere(tmp_path / "x.json")[1] == 5
    assert stage.read_text() == VARIANTS


def test_purposes(tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    kinds = {"default": 1, "render": 2, "proxy": 3, "guide": 4}
    prims = [f'def Xform "{k}"\n{{\nuniform token purpose = "{k}"\ndef Sphere "s"\n{{\ndouble radius = {r}\n}}\n}}' for k, r in kinds.items()]
    stage.write_text("#usda 1.0\n" + "\n".join(prims))
    for flags, radii in (([], [1, 2]), (["--purpose", "default,proxy"], [1, 3]), (["--purpose=guide"], [4])):
        assert main([str(stage), "-o", str(tmp_path / "x.json"), *flags]) == 0
        assert [s["radius"] for s in json.loads((tmp_path / "x.json").read_text()).get("shapes", [])] == radii


SETTINGS = """#usda 1.0
(
    renderSettingsPrimPath = "/Render/settings"
)
def Camera "first"
{
}
def Camera "second"
{
    float horizontalAperture = 24
    float verticalAperture = 18
    float horizontalApertureOffset = 3
    float focalLength = 24
    float fStop = 2
    float focusDistance = 7
    float exposure = 1
    float exposure:iso = 400
    float3 xformOp:scale = (2, 2, 2)
    uniform token[] xformOpOrder = ["xformOp:scale"]
}
def Camera "parallel"
{
    token projection = "orthographic"
    float horizontalAperture = 50
    float verticalAperture = 25
}
def Scope "Render"
{
    def RenderSettings "settings"
    {
        int2 resolution = (400, 200)
        float pixelAspectRatio = 2
        float4 dataWindowNDC = (0.25, 0.5, 1, 1)
        rel camera = </second>
        rel products = </Render/product>
    }
    def RenderProduct "product"
    {
        rel orderedVars = [</Render/color>, </Render/n>]
    }
    def RenderVar "color"
    {
        string sourceName = "Ci"
    }
    def RenderVar "n"
    {
        string sourceName = "normal"
    }
}
"""


def test_cameras_and_render_settings(tmp_path: Path) -> None:
    stage, out = tmp_path / "stage.usda", tmp_path / "x.json"
    stage.write_text(SETTINGS)
    assert main([str(stage), "-o", str(out)]) == 0
    scene = json.loads(out.read_text())
    film, camera = scene["film"], scene["camera"]
    assert film == {"resolution": [400, 200], "pixel_aspect": 2, "crop": [100, 0, 400, 100], "aovs": ["normal"]}
    # The picture is 4 : 1, so the aperture is widened from 24 to 72.
    assert camera["fov_x_deg"] == pytest.approx(math.degrees(2 * math.atan(36 / 24)))
    assert camera["shift"] == pytest.approx([3 / 72, 0])
    # 24/2 tenths of a unit across, twice as large in the world.
    assert camera["lens_radius"] == pytest.approx(0.5 * 1.2 * 2) and camera["focus_distance"] == pytest.approx(14)
    opened = Usd.Stage.Open(str(stage))
    usd = UsdGeom.Camera(opened.GetPrimAtPath("/second"))
    assert camera["exposure"] == pytest.approx(math.log2(usd.ComputeLinearExposureScale()))
    assert np.allclose(camera["transform"], np.eye(4))
    assert main([str(stage), "-o", str(out), "--camera", "/parallel"]) == 0
    camera = json.loads(out.read_text())["camera"]
    assert camera["type"] == "orthographic" and camera["width"] == pytest.approx(2.5 * 4)


@pytest.mark.parametrize(
    ("policy", "width", "height"),
    [("expandAperture", 40, 20), ("cropAperture", 20, 10), ("adjustApertureWidth", 40, 20), ("adjustApertureHeight", 20, 10)],
)
def test_conforming_apertures(policy: str, width: float, height: float) -> None:
    from resolvent_usd.cameras import _Window

    window = _Window(20, 20, 0, 0)
    assert window.conform(policy, (200, 100), 1.0) == 1.0
    assert (window.width, window.height) == (width, height)
    assert _Window(20, 10, 0, 0).conform("adjustPixelAspectRatio", (100, 100), 1.0) == 2.0


def test_usdz_textures_are_taken_out_and_layers_listed(tmp_path: Path) -> None:
    stage = next(DATA.rglob("*.usdz"))
    layers = tmp_path / "layers.json"
    assert main([str(stage), "-o", str(tmp_path / "x.json"), "--layers", str(layers)]) == 0
    expected = {str(stage): hashlib.blake2b(stage.read_bytes(), digest_size=16).hexdigest()}
    assert json.loads(layers.read_text()) == expected
