"""Textures as they are seen: a surface that shows its emission texture, looked at point by point."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import convert_file
from renders import looking, measure, write_png

# Rows from the top; texels are met in their middles.
IMAGE = np.array([[[255, 0, 0], [0, 255, 0]], [[0, 0, 255], [255, 255, 0]]])

STAGE = """#usda 1.0
def Mesh "q" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
  rel material:binding = </m>
  int[] faceVertexCounts = [4]
  int[] faceVertexIndices = [0, 1, 2, 3]
  point3f[] points = [(0, 0, 0), (3, 0, 0), (3, 3, 0), (0, 3, 0)]
  texCoord2f[] primvars:st = [(0, 0), (3, 0), (3, 3), (0, 3)] (
    interpolation = "vertex"
  )
  uniform token subdivisionScheme = "none"
}}
def Material "m" {{
  token outputs:surface.connect = </m/s.outputs:surface>
  def Shader "s" {{
    uniform token info:id = "UsdPreviewSurface"
    color3f inputs:emissiveColor.connect = </m/t.outputs:rgb>
    token outputs:surface
  }}
  def Shader "t" {{
    uniform token info:id = "UsdUVTexture"
    asset inputs:file = @./{file}@
    {settings}
    float2 inputs:st.connect = </m/x.outputs:result>
    float3 outputs:rgb
  }}
  def Shader "x" {{
    uniform token info:id = "UsdTransform2d"
    float2 inputs:in.connect = </m/r.outputs:result>
    {transform}
    float2 outputs:result
  }}
  def Shader "r" {{
    uniform token info:id = "UsdPrimvarReader_float2"
    string inputs:varname = "st"
    float2 outputs:result
  }}
}}
"""
REPEAT = 'token inputs:wrapS = "repeat"\n token inputs:wrapT = "repeat"\n'
MIRROR = 'token inputs:wrapS = "mirror"\n token inputs:wrapT = "clamp"\n'
RED, GREEN, BLUE, YELLOW, BLACK = (1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0), (0, 0, 0)
# Settings, transform, and colours at places of the surface, whose coordinates are its own x and y.
CASES = {
    "repeated": (REPEAT, "", {(0.25, 0.25): BLUE, (0.75, 0.25): YELLOW, (0.25, 0.75): RED, (1.75, 0.75): GREEN, (2.25, 2.25): BLUE}),
    "black beyond": ("", "", {(0.25, 0.75): RED, (1.5, 0.5): BLACK, (0.5, 2.5): BLACK}),
    "mirrored and clamped": (MIRROR, "", {(1.25, 0.25): YELLOW, (1.75, 0.75): RED, (0.25, 2.5): RED, (0.75, 2.5): GREEN}),
    "scaled, turned and moved": (
        REPEAT,
        "float2 inputs:scale = (0.5, 0.5)\n float inputs:rotation = 90\n float2 inputs:translation = (1, 0)",
        # (x, y) → (1 − y/2, x/2)
        {(0.5, 0.5): YELLOW, (0.5, 1.5): BLUE, (1.5, 0.5): GREEN, (1.5, 1.5): RED},
    ),
    "scale and bias": (
        REPEAT + "float4 inputs:scale = (0.5, 2, 1, 1)\n float4 inputs:bias = (0.25, 0, 0.5, 0)",
        "",
        {(0.25, 0.75): (0.75, 0, 0.5), (0.75, 0.75): (0.25, 2, 0.5)},
    ),
}


def seen(tmp_path: Path, file: str, settings: str, transform: str, places: dict[tuple[float, float], tuple[float, ...]]) -> None:
    (tmp_path / "stage.usda").write_text(STAGE.format(file=file, settings=settings, transform=transform))
    converted = convert_file(tmp_path / "stage.usda", tmp_path / "out.json")
    assert converted.losses("/m/t") == [] and converted.losses("/q") == []
    for (x, y), expected in places.items():
        scene = {**converted.scene, "camera": looking((x, y, 2), (x, y, 0), (0, 1, 0))}
        found = measure(scene, tmp_path, spp=1, edge=4).mean
        assert np.allclose(found, expected, atol=2e-3), ((x, y), found, expected)


@pytest.mark.parametrize("name", CASES)
def test_textures(tmp_path: Path, name: str) -> None:
    write_png(tmp_path / "t.png", IMAGE)
    seen(tmp_path, "t.png", *CASES[name])


def test_tiles(tmp_path: Path) -> None:
    """1001 lies at the origin, 1002 beside it, 1011 above; where there is no tile, there is nothing."""
    for number, color in ((1001, (255, 0, 0)), (1002, (0, 255, 0)), (1011, (0, 0, 255))):
        write_png(tmp_path / f"t.{number}.png", np.full((2, 2, 3), color))
    seen(tmp_path, "t.<UDIM>.png", "", "", {(0.5, 0.5): RED, (1.5, 0.5): GREEN, (0.5, 1.5): BLUE, (1.5, 1.5): BLACK, (2.5, 2.5): BLACK})


def test_colour_spaces(tmp_path: Path) -> None:
    """Code 128 is 0.2159 of sRGB and 0.502 of data."""
    write_png(tmp_path / "t.png", np.full((1, 1, 3), 128))
    for space, value in (("sRGB", 0.215861), ("raw", 128 / 255), ("auto", 0.215861)):
        folder = tmp_path / space
        folder.mkdir()
        write_png(folder / "t.png", np.full((1, 1, 3), 128))
        seen(folder, "t.png", REPEAT + f'token inputs:sourceColorSpace = "{space}"', "", {(0.5, 0.5): (value,) * 3})
