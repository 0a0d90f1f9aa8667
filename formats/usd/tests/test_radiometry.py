"""Lights give what UsdLux's specification says: irradiance on a white plane, and radiance seen directly, within 0.3 %."""

from __future__ import annotations

import functools
import re
from pathlib import Path

import numpy as np
import pytest
from conftest import Converted, convert_file
from expected_light import irradiance, luminance_factor, shaping
from pxr import Usd, UsdGeom, UsdLux
from renders import looking, measure, write_png

HEAD = '#usda 1.0\n(\n metersPerUnit = {unit}\n upAxis = "{up}"\n)\n'
# A white plane, z = 0, seen where the light falls; small, so that nothing is near it.
PLANE = """
def Mesh "plane" {
  int[] faceVertexCounts = [4]
  int[] faceVertexIndices = [0, 1, 2, 3]
  point3f[] points = [(-0.01, -0.01, 0), (0.01, -0.01, 0), (0.01, 0.01, 0), (-0.01, 0.01, 0)]
  uniform token subdivisionScheme = "none"
  color3f[] primvars:displayColor = [(1, 1, 1)]
}
"""


_STATEMENT = re.compile(r"(?<!uniform)\s+(?=(?:uniform|float3?|double3|bool|color3f|asset|token|int\[\]|point3f\[\]|def) )|(?<=\{)\s|\s(?=\})")


def stage_of(text: str, unit: float = 1.0, up: str = "Z", plane: str = PLANE) -> str:
    """A stage with a light; statements, which tests write in one line, on lines of their own."""
    return HEAD.format(unit=unit, up=up) + plane + _STATEMENT.sub("\n", text)


def converted_text(folder: Path, text: str) -> Converted:
    (folder / "stage.usda").write_text(text)
    return convert_file(folder / "stage.usda", folder / "stage.json")


@functools.cache
def opened(text: str) -> Usd.Stage:
    stage = Usd.Stage.CreateInMemory()
    stage.GetRootLayer().ImportFromString(text)
    return stage


def the_light(text: str) -> Usd.Prim:
    stage = opened(text)
    prims = [p for p in stage.Traverse() if p.HasAPI(UsdLux.LightAPI)]
    assert len(prims) == 1
    return prims[0]


def from_plane(tmp_path: Path, text: str, spp: int = 256):
    converted = converted_text(tmp_path, text)
    # From the side, below every light.
    scene = {**converted.scene, "camera": looking((0.0, -0.02, 0.005), (0, 0, 0))}
    return measure(scene, tmp_path, spp), converted


AREA = {
    "rect": 'def RectLight "l" { float inputs:width = 2 float inputs:height = 0.5 float inputs:intensity = 3 '
    "color3f inputs:color = (1, 0.5, 0.25) double3 xformOp:translate = (0.3, -0.2, 1.5) "
    'uniform token[] xformOpOrder = ["xformOp:translate"] }',
    "rect, exposure and normalize, turned and stretched": 'def Xform "a" { float3 xformOp:scale = (1, 2, 0.5) '
    'uniform token[] xformOpOrder = ["xformOp:scale"] def RectLight "l" { float inputs:exposure = 1.5 bool inputs:normalize = 1 '
    "double3 xformOp:translate = (1, 0.5, 3) float3 xformOp:rotateXYZ = (20, 30, 40) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"] } }',
    "rect, mirrored": 'def RectLight "l" { float inputs:intensity = 2 double3 xformOp:translate = (0.4, 0, 1) '
    'float3 xformOp:scale = (-2, 1, 1) uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }',
    "disk": 'def DiskLight "l" { float inputs:radius = 0.7 float inputs:intensity = 5 bool inputs:normalize = 1 '
    "double3 xformOp:translate = (0.5, 0.2, 1) float3 xformOp:scale = (2, 2, 2) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }',
    "disk, an ellipse": 'def DiskLight "l" { bool inputs:normalize = 1 double3 xformOp:translate = (0.5, 0.2, 1) '
    'float3 xformOp:scale = (2, 0.5, 1) uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }',
    "disk, shaped": 'def DiskLight "l" ( prepend apiSchemas = ["ShapingAPI"] ) { float inputs:radius = 0.4 '
    "float inputs:shaping:cone:angle = 50 float inputs:shaping:cone:softness = 0.6 float inputs:shaping:focus = 3 "
    "color3f inputs:shaping:focusTint = (0.5, 0.2, 0) double3 xformOp:translate = (0.6, 0, 1.2) float3 xformOp:rotateXYZ = (0, 15, 0) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"] }',
    "sphere, scaled, with a colour temperature": 'def SphereLight "l" { float inputs:radius = 0.25 float inputs:intensity = 30 '
    "bool inputs:enableColorTemperature = 1 float inputs:colorTemperature = 3200 double3 xformOp:translate = (-1, 0.5, 2) "
    'float3 xformOp:scale = (2, 2, 2) uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }',
    "sphere, an ellipsoid, normalized": 'def SphereLight "l" { float inputs:intensity = 8 bool inputs:normalize = 1 '
    "double3 xformOp:translate = (0.5, 0.5, 2) float3 xformOp:rotateXYZ = (30, 0, 50) float3 xformOp:scale = (3, 1, 0.4) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ", "xformOp:scale"] }',
    "sphere, a spot light": 'def SphereLight "l" ( prepend apiSchemas = ["ShapingAPI"] ) { float inputs:radius = 0.1 '
    "float inputs:intensity = 100 float inputs:shaping:cone:angle = 30 float inputs:shaping:cone:softness = 1 "
    'double3 xformOp:translate = (0.5, 0, 2) uniform token[] xformOpOrder = ["xformOp:translate"] }',
    "cylinder": 'def CylinderLight "l" { float inputs:length = 1.5 float inputs:radius = 0.1 float inputs:intensity = 12 '
    "double3 xformOp:translate = (0.4, 0.3, 1) float3 xformOp:rotateXYZ = (0, 20, 70) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:rotateXYZ"] }',
    "cylinder, stretched and normalized": 'def CylinderLight "l" { float inputs:radius = 0.3 bool inputs:normalize = 1 '
    "double3 xformOp:translate = (0, 0.3, 1.5) float3 xformOp:scale = (2, 1, 0.5) "
    'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"] }',
}


@pytest.mark.parametrize("name", AREA)
def test_area_lights(tmp_path: Path, name: str) -> None:
    text = stage_of(AREA[name])
    # Triangles are chosen by area, also those that face away.
    found, converted = from_plane(tmp_path, text, 2048 if "ellipsoid" in name else 256)
    prim = the_light(text)
    found.agrees(irradiance(prim, (0, 0, 0), (0, 0, 1)) / np.pi)
    exact = not any(word in name for word in ("ellipse", "ellipsoid", "stretched and normalized"))
    assert exact == (converted.losses("/l") == [])


@pytest.mark.parametrize("unit", [1.0, 0.01])
@pytest.mark.parametrize("up", ["Y", "Z"])
def test_units_and_axes_change_nothing(tmp_path: Path, unit: float, up: str) -> None:
    """Emission is a radiance, and areas are in the stage's unit."""
    text = stage_of(AREA["rect, exposure and normalize, turned and stretched"], unit, up)
    found, _ = from_plane(tmp_path, text)
    found.agrees(irradiance(the_light(text), (0, 0, 0), (0, 0, 1)) / np.pi)


def test_texture_of_a_rectangle(tmp_path: Path) -> None:
    """The image's upper left corner is at (+x, +y) of the light, which shows it upright towards −z."""
    image = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 255]]])
    write_png(tmp_path / "window.png", image)
    light = (
        'def RectLight "l" { asset inputs:texture:file = @./window.png@ float inputs:width = 2 float inputs:height = 3 '
        'double3 xformOp:translate = (0.4, -0.6, 0.5) uniform token[] xformOpOrder = ["xformOp:translate"] }'
    )

    def texture(s: np.ndarray, t: np.ndarray) -> np.ndarray:
        # s and t run along +x and +y: the image runs from +x and down. Texels are bilinear, clamped at the edges.
        x, y = np.clip((1 - s) * 2 - 0.5, 0, 1)[..., None], np.clip((1 - t) * 2 - 0.5, 0, 1)[..., None]
        i = image / 255.0
        return (1 - y) * ((1 - x) * i[0, 0] + x * i[0, 1]) + y * ((1 - x) * i[1, 0] + x * i[1, 1])

    text = stage_of(light)
    found, _ = from_plane(tmp_path, text, 1024)
    found.agrees(irradiance(the_light(text), (0, 0, 0), (0, 0, 1), texture) / np.pi)


@pytest.mark.parametrize("normalize", [0, 1])
@pytest.mark.parametrize("angle", [0.0, 0.53, 40.0, 180.0])
def test_distant_lights(tmp_path: Path, angle: float, normalize: int) -> None:
    """Unnormalized, the disc has the radiance L; normalized, a plane that faces it gets L. The axis is 25° from the normal."""
    light = (
        f'def DistantLight "l" {{ float inputs:angle = {angle} float inputs:intensity = 3 float inputs:exposure = -1 '
        f"bool inputs:normalize = {normalize} float3 xformOp:rotateXYZ = (25, 0, 30) float3 xformOp:scale = (3, 3, 3) "
        'uniform token[] xformOpOrder = ["xformOp:rotateXYZ", "xformOp:scale"] }'
    )
    text = stage_of(light)
    found, _ = from_plane(tmp_path, text, 512)
    half = np.radians(angle / 2)
    size = np.pi * np.sin(half) ** 2 if angle else 1.0
    # ∫ max(cos θ, 0) over the cap, in rings around the axis; of half a sphere tilted by t, π (1 + cos t)/2 is above.
    n = 2000
    theta = half * (np.arange(n) + 0.5) / n
    phi = 2 * np.pi * (np.arange(n) + 0.5) / n
    tilt = np.radians(25)
    cosine = np.cos(theta)[:, None] * np.cos(tilt) + np.sin(theta)[:, None] * np.cos(phi) * np.sin(tilt)
    ring = np.sin(theta) * half / n * 2 * np.pi
    falls = float((np.maximum(cosine, 0).mean(axis=1) * ring).sum()) if angle else np.cos(tilt)
    radiance = 1.5 / (size if normalize else 1.0)
    found.agrees(np.full(3, radiance * falls / np.pi))


def test_point(tmp_path: Path) -> None:
    """From afar a sphere and the point that stands for it are the same: π r² L."""
    light = (
        'def SphereLight "l" { bool treatAsPoint = 1 float inputs:radius = 0.2 float inputs:intensity = 50 '
        'double3 xformOp:translate = (1, 0, 2) float3 xformOp:scale = (2, 2, 2) uniform token[] xformOpOrder = '
        '["xformOp:translate", "xformOp:scale"] }'
    )
    found, converted = from_plane(tmp_path, stage_of(light), 64)
    assert converted.scene["lights"][0]["type"] == "point"
    found.agrees(np.full(3, 50 * np.pi * 0.4**2 * 2 / np.sqrt(5) / 5 / np.pi))


def half_and_half(tmp_path: Path) -> None:
    """Longitudes 0 to π (the left half of the image) are red, the others green; the upper half is blue, too."""
    image = np.zeros((64, 128, 3))
    image[:, :64, 0] = 255
    image[:, 64:, 1] = 255
    image[:32, :, 2] = 255
    write_png(tmp_path / "sky.png", image)


DOMES = {
    # Towards +x, longitude π/2, red; blue towards +y.
    "DomeLight, Y up": ("DomeLight", "Y", "", {(1, -0.5, 0.1): "r", (-1, -0.5, 0.1): "g", (0.1, 1, 0): "rb", (-0.1, 1, 0): "gb"}),
    # The same with Z up: its pole stays +y.
    "DomeLight, Z up": ("DomeLight", "Z", "", {(1, -0.5, 0.1): "r", (-1, -0.5, 0.1): "g", (-0.1, 1, 0): "gb"}),
    # The pole is +z, longitude 0 points to −y, π/2 to +x.
    "DomeLight_1, Z up": ("DomeLight_1", "Z", "", {(1, 0.1, -0.5): "r", (-1, 0.1, -0.5): "g", (0.1, 0, 1): "rb"}),
    "DomeLight_1, pole Y": ("DomeLight_1", "Z", 'token poleAxis = "Y"', {(1, -0.5, 0.1): "r", (-0.1, 1, 0): "gb"}),
    # A quarter turn about +y takes +x to −z.
    "turned": (
        "DomeLight",
        "Y",
        'float3 xformOp:rotateXYZ = (0, 90, 0) uniform token[] xformOpOrder = ["xformOp:rotateXYZ"]',
        {(0.1, -0.5, -1): "r", (0.1, -0.5, 1): "g", (0.1, 1, -0.2): "rb"},
    ),
    # Mirrored, +x is where −x was.
    "mirrored": (
        "DomeLight",
        "Y",
        'float3 xformOp:scale = (-1, 1, 1) uniform token[] xformOpOrder = ["xformOp:scale"]',
        {(-1, -0.5, 0.1): "r", (1, -0.5, 0.1): "g"},
    ),
}


@pytest.mark.parametrize("name", DOMES)
def test_orientation_of_domes(tmp_path: Path, name: str) -> None:
    kind, up, extra, seen = DOMES[name]
    half_and_half(tmp_path)
    light = f'def {kind} "l" {{ float inputs:intensity = 2 asset inputs:texture:file = @./sky.png@ {extra} }}'
    converted = converted_text(tmp_path, stage_of(light, up=up, plane=""))
    for direction, colors in seen.items():
        scene = {**converted.scene, "camera": looking((0, 0, 0), direction, (0.3, 0.4, 0.5))}
        found = measure(scene, tmp_path, spp=1, edge=4)
        assert np.allclose(found.mean, [2.0 * (c in colors) for c in "rgb"]), (direction, found.mean)


def test_dome_on_a_plane(tmp_path: Path) -> None:
    """A uniform dome of radiance L gives π L; ``normalize`` means nothing to it."""
    light = 'def DomeLight "l" { float inputs:intensity = 0.5 float inputs:exposure = 1 color3f inputs:color = (1, 2, 3) bool inputs:normalize = 1 }'
    found, _ = from_plane(tmp_path, stage_of(light), 256)
    found.agrees([1, 2, 3])


def test_mesh_light(tmp_path: Path) -> None:
    """A mesh of the rectangle's shape gives what the rectangle gives, also normalized and under a stretch."""
    ops = (
        'double3 xformOp:translate = (0.4, 0.1, 1.3) float3 xformOp:scale = (2, 0.5, 1) '
        'uniform token[] xformOpOrder = ["xformOp:translate", "xformOp:scale"]'
    )
    rect = f'def RectLight "l" {{ float inputs:intensity = 7 bool inputs:normalize = 1 {ops} }}'
    mesh = (
        'def Mesh "l" ( prepend apiSchemas = ["MeshLightAPI"] ) { float inputs:intensity = 7 bool inputs:normalize = 1 '
        "int[] faceVertexCounts = [4] int[] faceVertexIndices = [3, 2, 1, 0] "
        "point3f[] points = [(-0.5, -0.5, 0), (0.5, -0.5, 0), (0.5, 0.5, 0), (-0.5, 0.5, 0)] "
        f'uniform token subdivisionScheme = "none" {ops} }}'
    )
    found, converted = from_plane(tmp_path, stage_of(mesh))
    assert converted.losses("/l") == []
    found.agrees(irradiance(the_light(stage_of(rect)), (0, 0, 0), (0, 0, 1)) / np.pi)


@pytest.mark.parametrize("name", ["rect", "disk, shaped", "sphere, a spot light", "cylinder, stretched and normalized"])
def test_seen_directly(tmp_path: Path, name: str) -> None:
    """A light shows its radiance in the direction in which it is seen; its dark side nothing."""
    text = stage_of(AREA[name], plane="")
    prim = the_light(text)
    m = np.array(UsdGeom.XformCache().GetLocalToWorldTransform(prim)).T
    axis = m[:3, :3] @ np.array([0, 0, -1.0])
    axis /= np.linalg.norm(axis)
    middle = m[:3, 3]
    scene = converted_text(tmp_path, text).scene
    for side in (0.0, 0.3, 0.55):
        w = axis + side * np.array([0.6, -0.8, 0.1])
        w /= np.linalg.norm(w)
        size = 1.0
        if "normalized" in name:
            # 2π r · length with half axes 0.3 and 0.15, by the integral.
            phi = 2 * np.pi * (np.arange(100000) + 0.5) / 100000
            size = 2 * np.hypot(0.3 * np.sin(phi), 0.15 * np.cos(phi)).mean() * 2 * np.pi
        expected = luminance_factor(prim) * shaping(prim, axis, w) / size
        seen = measure({**scene, "camera": looking(middle + 5 * w, middle, (0.3, 0.4, 0.5))}, tmp_path, spp=1, edge=4)
        assert np.allclose(seen.mean, expected, rtol=1e-3, atol=1e-5), (side, seen.mean, expected)
    if name in ("rect", "disk, shaped"):
        back = measure({**scene, "camera": looking(middle - 5 * axis, middle, (0.3, 0.4, 0.5))}, tmp_path, spp=1, edge=4)
        assert not back.mean.any()
