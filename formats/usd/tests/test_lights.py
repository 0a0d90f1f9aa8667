"""Lights beyond their radiometry: what is reported, copies, and odd values."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
from conftest import Converted, convert_file

from resolvent_usd.lights import areas
from resolvent_usd.report import InputError

_numbers = itertools.count()


def stage(folder: Path, body: str) -> Converted:
    source = folder / f"stage{next(_numbers)}.usda"
    source.write_text("#usda 1.0\n" + body.replace("; ", "\n").replace("{ ", "{\n").replace(" }", "\n}"))
    return convert_file(source, folder / "out.json")


def light(inputs: str, kind: str = "SphereLight", schemas: str = "") -> str:
    applied = f"( prepend apiSchemas = [{schemas}] )" if schemas else ""
    return f'def {kind} "l" {applied} {{ {inputs} }}'


@pytest.mark.parametrize(
    ("schemas", "inputs", "what"),
    [
        ("", "float inputs:diffuse = 0.5", "inputs:diffuse"),
        ("", "float inputs:specular = 2", "inputs:specular"),
        ("", "rel light:filters = </f>", "light:filters"),
        ('"ShadowAPI"', "bool inputs:shadow:enable = 0", "inputs:shadow:enable"),
        ('"ShadowAPI"', "color3f inputs:shadow:color = (1, 0, 0)", "inputs:shadow:color"),
        ('"ShapingAPI"', "asset inputs:shaping:ies:file = @./lamp.ies@", "inputs:shaping:ies:file"),
        ("", "float inputs:shaping:focus = 3", "inputs:shaping"),
        ("", "rel collection:lightLink:includes = </f>", "collection:lightLink"),
        ("", "uniform bool collection:shadowLink:includeRoot = 0", "collection:shadowLink"),
        ("", "float inputs:intensity.connect = </s.outputs:out>", "inputs:intensity"),
    ],
)
def test_what_has_no_effect_is_said(tmp_path: Path, schemas: str, inputs: str, what: str) -> None:
    shader = 'def Shader "s" { uniform token info:id = "noise"; float outputs:out }\n'
    converted = stage(tmp_path, shader + light(inputs, schemas=schemas))
    assert [x.what for x in converted.report.losses if x.path == "/l"] == [what]
    assert converted.scene["shapes"][0]["emission"] == [1, 1, 1]


def test_controls_at_their_defaults_are_no_loss(tmp_path: Path) -> None:
    defaults = "bool inputs:shadow:enable = 1; float inputs:shadow:distance = -1; float inputs:shaping:cone:angle = 180; float inputs:diffuse = 1"
    converted = stage(tmp_path, light(defaults, schemas='"ShadowAPI", "ShapingAPI"'))
    assert converted.losses("/l") == [] and "shaping" not in converted.scene["shapes"][0]


def test_ies_profiles_are_named(tmp_path: Path) -> None:
    converted = stage(tmp_path, light("asset inputs:shaping:ies:file = @./lamp.ies@", schemas='"ShapingAPI"'))
    assert any("lamp.ies" in x for x in converted.losses("/l"))


def test_values_out_of_range(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="/l.inputs:radius: is -1"):
        stage(tmp_path, light("float inputs:radius = -1"))
    with pytest.raises(InputError, match="not finite"):
        stage(tmp_path, light("float inputs:intensity = nan"))
    with pytest.raises(InputError, match="out of range"):
        stage(tmp_path, light("float inputs:exposure = 1000"))
    converted = stage(tmp_path, light("float inputs:intensity = -1"))
    assert "shapes" not in converted.scene and any("negative" in x for x in converted.losses("/l"))
    converted = stage(tmp_path, light("float inputs:radius = 0"))
    assert "shapes" not in converted.scene and any("no area" in x for x in converted.losses("/l"))


def test_dark_and_invisible_lights_are_not_there(tmp_path: Path) -> None:
    converted = stage(tmp_path, light("float inputs:intensity = 0"))
    assert not {"lights", "shapes"} & set(converted.scene) and converted.losses("/l") == []
    converted = stage(tmp_path, light('token visibility = "invisible"'))
    assert not {"lights", "shapes"} & set(converted.scene)


def test_inputs_follow_connections(tmp_path: Path) -> None:
    """An input that another light's input, or an attribute of a material's interface, gives."""
    other = 'def Material "m" { color3f inputs:tint = (1, 0.5, 0.25) }\n'
    converted = stage(tmp_path, other + light("color3f inputs:color.connect = </m.inputs:tint>"))
    assert converted.scene["shapes"][0]["emission"] == [1, 0.5, 0.25] and converted.losses("/l") == []


def test_lights_in_instances_are_lights_of_their_own(tmp_path: Path) -> None:
    lamp = (
        'class Xform "lamp" { def RectLight "l" { double3 xformOp:translate = (0, 0, 1); uniform token[] xformOpOrder = ["xformOp:translate"] }; }\n'
    )
    copies = "".join(
        f'def Xform "c{x}" ( instanceable = true\n inherits = </lamp> ) {{ double3 xformOp:translate = ({x}, 0, 0); '
        'uniform token[] xformOpOrder = ["xformOp:translate"] }\n'
        for x in (3, 7)
    )
    converted = stage(tmp_path, lamp + copies)
    corners = sorted(s["corner"] for s in converted.scene["shapes"])
    assert np.allclose(corners, [[3.5, -0.5, 1], [7.5, -0.5, 1]])


def test_geometry_lights(tmp_path: Path) -> None:
    ball = 'def Sphere "ball" { double radius = 2 }\n'
    converted = stage(tmp_path, ball + light("rel geometry = </ball>; float inputs:intensity = 5", "GeometryLight"))
    assert converted.scene["shapes"][0]["emission"] == [5, 5, 5] and converted.losses("/l") == []
    converted = stage(tmp_path, ball + light("rel geometry = </gone>", "GeometryLight"))
    assert any("/gone" in x for x in converted.losses("/l"))


def test_mappings_of_domes(tmp_path: Path) -> None:
    (tmp_path / "sky.exr").write_bytes(b"")
    image = "asset inputs:texture:file = @./sky.exr@; token inputs:texture:format = "
    for usd, ours in (("angular", "angular"), ("mirroredBall", "mirrored_ball"), ("cubeMapVerticalCross", "vertical_cross")):
        converted = stage(tmp_path, light(f'{image}"{usd}"', "DomeLight"))
        assert converted.scene["lights"][0]["mapping"] == ours and converted.losses("/l")
    for usd in ("automatic", "latlong"):
        converted = stage(tmp_path, light(f'{image}"{usd}"', "DomeLight"))
        assert "mapping" not in converted.scene["lights"][0] and converted.losses("/l") == []


def test_areas() -> None:
    """Of spheres and circular cylinders; of a prolate spheroid in closed form; and the meshes have them."""
    assert np.isclose(areas.ellipsoid(3 * np.eye(3)), 36 * np.pi)
    a, c = 1.0, 3.0
    e = np.sqrt(1 - a * a / c / c)
    spheroid = 2 * np.pi * a * a * (1 + c / (a * e) * np.arcsin(e))
    assert np.isclose(areas.ellipsoid(np.diag([a, a, c])), spheroid, rtol=1e-9)
    axis, u, v = np.array([2.0, 0, 0]), np.array([0, 0.5, 0]), np.array([0, 0, 0.5])
    assert np.isclose(areas.cylinder(axis, u, v), 2 * np.pi)
    # Oblique: its area is the perimeter of the section across the axis times the axis' length.
    slant = np.array([2.0, 1.0, 0])
    across = 0.5 * 2 / np.sqrt(5)
    phi = 2 * np.pi * (np.arange(4096) + 0.5) / 4096
    perimeter = np.hypot(across * np.sin(phi), 0.5 * np.cos(phi)).mean() * 2 * np.pi
    assert np.isclose(areas.cylinder(slant, u, v), perimeter * np.sqrt(5))
    shear = np.array([[1.0, 0.3, 0], [0, 2, 0], [0.1, 0, 0.5]])
    points, triangles = areas.ellipsoid_mesh(shear, 3)
    assert np.isclose(areas._mesh_area(points, triangles), areas.ellipsoid(shear))
    p = points[triangles]
    outwards = np.einsum("ij,ij->i", np.cross(p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]), p.mean(axis=1))
    assert (outwards > 0).all() and len(triangles) == 20 * 4**3
