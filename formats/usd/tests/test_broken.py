"""Broken stages: a message with the prim's path and exit code 2; with --keep-going the rest converts and the report names what is missing."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from conftest import DATA
from resolvent_usd.cli import main

GOOD = '\ndef Sphere "good" { \n double radius = 1 \n}\n'
FACES = "int[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 2]"
POINTS = "point3f[] points = [(0, 0, 0), (1, 0, 0), (0, 1, 0)]"

BROKEN = {
    "unresolved reference": ('def Xform "bad" (references = @./missing.usda@)\n{\n}', "/bad", "missing.usda"),
    "unresolved payload": ('def Xform "bad" (payload = @./missing.usda@)\n{\n}', "/bad", "missing.usda"),
    "missing target": ('def Xform "bad" (references = </nowhere>)\n{\n}', "/bad", "nowhere"),
    "cyclic reference": (
        'def Xform "bad" (references = </other>)\n{\n}\ndef Xform "other" (references = </bad>)\n{\n}', "/", "ycle",
    ),
    "counts": (f'def Mesh "bad"\n{{\nint[] faceVertexCounts = [4]\nint[] faceVertexIndices = [0, 1, 2]\n{POINTS}\n}}', "/bad", "adds up to 4"),
    "small face": (f'def Mesh "bad"\n{{\nint[] faceVertexCounts = [2]\nint[] faceVertexIndices = [0, 1]\n{POINTS}\n}}', "/bad", "at least 3"),
    "index": (f'def Mesh "bad"\n{{\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, 3]\n{POINTS}\n}}', "/bad", "names point 3"),
    "negative index": (f'def Mesh "bad"\n{{\nint[] faceVertexCounts = [3]\nint[] faceVertexIndices = [0, 1, -1]\n{POINTS}\n}}', "/bad", "names point -1"),
    "nan point": (f'def Mesh "bad"\n{{\n{FACES}\npoint3f[] points = [(0, 0, 0), (nan, 0, 0), (0, 1, 0)]\n}}', "/bad.points", "not finite"),
    "hole": (f'def Mesh "bad"\n{{\n{FACES}\n{POINTS}\nint[] holeIndices = [1]\n}}', "/bad.holeIndices", "not there"),
    "nan transform": (
        'def Sphere "bad"\n{\ndouble3 xformOp:translate = (nan, 0, 0)\nuniform token[] xformOpOrder = ["xformOp:translate"]\n}', "/bad", "not finite",
    ),
    "infinite scale": (
        'def Sphere "bad"\n{\nfloat3 xformOp:scale = (inf, 1, 1)\nuniform token[] xformOpOrder = ["xformOp:scale"]\n}', "/bad", "not finite",
    ),
    "radius": ('def Sphere "bad"\n{\ndouble radius = -1\n}', "/bad.radius", "> 0"),
    "curves": ('def BasisCurves "bad"\n{\nint[] curveVertexCounts = [5]\npoint3f[] points = [(0, 0, 0)]\n}', "/bad.curveVertexCounts", "adds up to 5"),
    "texture": (
        f"""def Mesh "bad" (prepend apiSchemas = ["MaterialBindingAPI"])
{{
{FACES}
{POINTS}
rel material:binding = </mat>
}}
def Material "mat"
{{
    token outputs:surface.connect = </mat/s.outputs:surface>
    def Shader "s"
    {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>
        token outputs:surface
    }}
    def Shader "t"
    {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @./missing.png@
        float3 outputs:rgb
    }}
}}""", "/mat/t", "missing.png",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken(name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    text, path, words = BROKEN[name]
    stage, scene, report = tmp_path / "stage.usda", tmp_path / "scene.json", tmp_path / "report.json"
    stage.write_text("#usda 1.0\n" + text + GOOD)
    assert main([str(stage), "-o", str(scene)]) == 2
    error = capsys.readouterr().err.strip().splitlines()[-1]
    assert error.startswith("error: " + path) and words in error
    assert not scene.exists()
    assert main([str(stage), "-o", str(scene), "--keep-going", "--report", str(report)]) == 0
    spheres = [s for s in json.loads(scene.read_text())["shapes"] if s["type"] == "sphere"]
    assert len(spheres) == 1
    failed = [x for x in json.loads(report.read_text())["losses"] if x["kind"] == "failed"]
    assert any(x["path"].startswith(path) and words in x["reason"] for x in failed)


@pytest.mark.parametrize("content", [b"", b"no stage at all", b"PXR-USDC" + bytes(80), b"#usda 1.0\ndef Mesh \"x\" {"])
def test_no_stage(content: bytes, tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    stage = tmp_path / "stage.usd"
    stage.write_bytes(content)
    assert main([str(stage), "-o", str(tmp_path / "scene.json")]) == 2
    assert str(stage) in capsys.readouterr().err
    assert main([str(tmp_path / "none.usda"), "-o", str(tmp_path / "scene.json")]) == 2
    assert "none.usda" in capsys.readouterr().err


def test_meshes_of_wrong_types_are_left_out_alone(tmp_path: Path) -> None:
    stage = next(DATA.rglob("pointsTypes.usda"))
    scene = tmp_path / "scene.json"
    assert main([str(stage), "-o", str(scene), "--keep-going"]) == 0
    assert len(json.loads(scene.read_text())["shapes"]) >= 4


def test_losses_are_errors_with_strict(tmp_path: Path) -> None:
    stage = tmp_path / "stage.usda"
    camera = 'def Camera "c"\n{\n}\n'
    for text, code in ((GOOD, 0), ('def Cone "c2"\n{\n}\n', 2)):
        stage.write_text("#usda 1.0\n" + camera + text)
        assert main([str(stage), "-o", str(tmp_path / "scene.json"), "--strict"]) == code
        stage = tmp_path / "second.usda"
