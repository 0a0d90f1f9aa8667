"""References to MaterialX documents, which usd-core can't open itself."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, PIXEL, Converted, convert_file

from resolvent_usd.cli import main
from resolvent_usd.report import InputError

STAGE = """#usda 1.0
def "looks" (
    references = @./looks.mtlx@{target}
)
{{
}}
def Sphere "ball" (
    prepend apiSchemas = ["MaterialBindingAPI"]
)
{{
    rel material:binding = <{bound}>
}}
"""
HEAD = '<?xml version="1.0"?>\n<materialx version="1.39"{}>\n'


def converted(folder: Path, document: str, target: str = "", bound: str = "/looks/Materials/M", head: str = "", **options: Any) -> Converted:
    (folder / "looks.mtlx").write_text(HEAD.format(head) + document + "\n</materialx>")
    (folder / "stage.usda").write_text(STAGE.format(target=target, bound=bound))
    return convert_file(folder / "stage.usda", folder / "out.json", **options)


def material(found: Converted) -> dict[str, Any]:
    (shape,) = found.scene["shapes"]
    return found.scene["materials"][shape["material"]]


def surface(inputs: str, kind: str = "standard_surface") -> str:
    return (
        f'<{kind} name="S" type="surfaceshader">{inputs}</{kind}>\n'
        '<surfacematerial name="M" type="material"><input name="surfaceshader" type="surfaceshader" nodename="S"/></surfacematerial>'
    )


def number(name: str, value: Any, kind: str = "float") -> str:
    return f'<input name="{name}" type="{kind}" value="{value}"/>'


@pytest.mark.parametrize(
    ("target", "bound"),
    [("", "/looks/Materials/M"), ("</MaterialX>", "/looks/Materials/M"), ("</MaterialX/Materials>", "/looks/M"), ("</MaterialX/Materials/M>", "/looks")],
)
def test_constants(tmp_path: Path, target: str, bound: str) -> None:
    inputs = number("base", 0.5) + number("base_color", "0.5, 0.25, 1", "color3") + number("metalness", 1) + number("specular_roughness", 0.25)
    found = converted(tmp_path, surface(inputs + number("thin_walled", "true", "boolean") + number("emission", 2)), target, bound)
    params = material(found)["params"]
    assert params["base_color"] == [0.25, 0.125, 0.5] and params["metallic"] == 1 and params["roughness"] == 0.25 and params["thin"] is True
    assert found.scene["shapes"][0]["emission"] == [2, 2, 2]
    assert [x for x in found.report.losses if x.what != "camera"] == []


@pytest.mark.parametrize(
    ("kind", "name", "parameter"),
    [("open_pbr_surface", "fuzz_weight", "sheen"), ("UsdPreviewSurface", "clearcoat", "clearcoat"), ("standard_surface", "coat", "clearcoat")],
)
def test_surfaces(tmp_path: Path, kind: str, name: str, parameter: str) -> None:
    assert material(converted(tmp_path, surface(number(name, 0.75), kind)))["params"][parameter] == 0.75


def test_images_stand_beside_the_document(tmp_path: Path) -> None:
    """Through a node graph with an interface, a prefix of files, and the colour space of the document."""
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "wood.png").write_bytes(PIXEL)
    graph = """
<nodegraph name="G">
  <input name="tint" type="color3" value="0.5, 0.5, 0.25"/>
  <image name="I" type="color3"><input name="file" type="filename" value="wood.png" colorspace="srgb_texture"/>
    <input name="uaddressmode" type="string" value="mirror"/></image>
  <multiply name="X" type="color3"><input name="in1" type="color3" nodename="I"/><input name="in2" type="color3" interfacename="tint"/></multiply>
  <output name="color" type="color3" nodename="X"/>
</nodegraph>"""
    feed = '<input name="base_color" type="color3" nodegraph="G" output="color"/>'
    found = converted(tmp_path, graph + surface(feed), head=' fileprefix="maps/" colorspace="lin_rec709"')
    texture = found.scene["textures"][material(found)["params"]["base_color"]["texture"]]
    assert found.path(texture["file"]).resolve() == (tmp_path / "maps" / "wood.png").resolve()
    assert texture["color_space"] == "srgb" and texture["wrap_u"] == "mirror" and texture["scale"] == [0.5, 0.5, 0.25]
    assert [x for x in found.losses("/ball") if "texture coordinates" not in x] == []


def clockwise(uv: np.ndarray, degrees: float) -> np.ndarray:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.stack([c * uv[:, 0] + s * uv[:, 1], -s * uv[:, 0] + c * uv[:, 1]], axis=1)


@pytest.mark.parametrize(("order", "scale"), [(0, (2.0, -0.5)), (1, (0.5, 0.5))])
def test_places_of_images(tmp_path: Path, order: int, scale: tuple[float, float]) -> None:
    """place2d and tiledimage as MaterialX's own node graphs compute them, one after the other; what is sheared is reported."""
    (tmp_path / "t.png").write_bytes(PIXEL)
    place = (
        '<place2d name="P" type="vector2"><input name="pivot" type="vector2" value="0.5, 0.25"/>'
        f'<input name="scale" type="vector2" value="{scale[0]}, {scale[1]}"/><input name="rotate" type="float" value="30"/>'
        f'<input name="offset" type="vector2" value="0.1, -0.2"/><input name="operationorder" type="integer" value="{order}"/></place2d>'
    )
    tiles = (
        '<tiledimage name="I" type="color3"><input name="file" type="filename" value="t.png"/><input name="texcoord" type="vector2" nodename="P"/>'
        '<input name="uvtiling" type="vector2" value="{0}"/><input name="uvoffset" type="vector2" value="0.25, 0.5"/>'
        '<input name="realworldtilesize" type="vector2" value="2, 2"/></tiledimage>'
    )
    feed = surface('<input name="base_color" type="color3" nodename="I"/>')
    found = converted(tmp_path, place + tiles.format("3, 3") + feed)
    (texture,) = found.scene["textures"].values()
    uv = np.random.default_rng(1).random((5, 2))
    pivot, offset = np.array([0.5, 0.25]), np.array([0.1, -0.2])
    inner = (clockwise((uv - pivot) / scale, 30) - offset if order == 0 else clockwise(uv - pivot - offset, 30) / scale) + pivot
    t = texture["uv_transform"]
    seen = clockwise(uv * t["scale"], -t["rotation_deg"]) + t["offset"]
    assert np.allclose(seen, (3 * inner - [0.25, 0.5]) * 2, atol=1e-6) and found.losses("/looks/Materials/M/I") == []
    if order == 0:
        sheared = converted(tmp_path, place + tiles.format("3, 1") + feed)
        assert any("sheared" in x for x in sheared.losses("/looks/Materials/M/I"))


def test_colours_in_srgb(tmp_path: Path) -> None:
    color = '<input name="base_color" type="color3" value="0.5, 0.02, 1" colorspace="srgb_texture"/>'
    assert material(converted(tmp_path, surface(color)))["params"]["base_color"] == pytest.approx([0.214041, 0.02 / 12.92, 1], abs=1e-6)


def test_included_documents(tmp_path: Path) -> None:
    """They count as sources of the stage, for the cache."""
    (tmp_path / "more.mtlx").write_text(HEAD.format("") + surface(number("coat", 0.5)) + "\n</materialx>")
    document = '<xi:include href="more.mtlx" xmlns:xi="http://www.w3.org/2001/XInclude"/>'
    assert material(converted(tmp_path, document))["params"]["clearcoat"] == 0.5
    layers = tmp_path / "layers.json"
    assert main([str(tmp_path / "stage.usda"), "-o", str(tmp_path / "x.json"), "--layers", str(layers)]) == 0
    assert {Path(p).name for p in json.loads(layers.read_text())} == {"stage.usda", "looks.mtlx", "more.mtlx"}


def test_primvars_of_subsets_and_materials(tmp_path: Path) -> None:
    """OpenUSD's own test: red of the mesh, green of the subset, blue of the material make a grey; nothing is lost."""
    found = convert_file(DATA / "openusd" / "GeomSubsets" / "primvars.usda", tmp_path / "out.json")
    assert found.report.losses == []
    assert {found.scene["materials"][s["material"]]["params"]["base_color"] for s in found.scene["shapes"]} == {0.5}


def test_what_is_unknown_is_reported(tmp_path: Path) -> None:
    noise = '<fractal3d name="N" type="float"/>'
    found = converted(tmp_path, noise + surface('<input name="base" type="float" nodename="N"/>' + number("frobnication", 1)))
    losses = " ".join(found.losses("/looks/Materials/M/S"))
    assert "fractal3d" in losses and "inputs:frobnication" in losses
    found = converted(tmp_path, surface("", "toon"))
    assert any("toon" in x for x in found.losses("/looks/Materials/M/S")) and material(found)["plugin"] == "diffuse"


BROKEN = {
    "no XML": ("<unclosed>", "", "looks.mtlx: can't be read as a MaterialX document"),
    "no such material": (surface(""), "</MaterialX/Materials/W>", "/looks: refers to </MaterialX/Materials/W>.*its materials are: /MaterialX/Materials/M"),
    "no such node": (surface('<input name="base" type="float" nodename="none"/>'), "", "'base' names the node 'none', which is not there"),
    "no such graph": (surface('<input name="base" type="float" nodegraph="none"/>'), "", "'none', which is not there"),
    "no number": (surface(number("base", "much")), "", "'base' has the value 'much', which is no float"),
    "two numbers": (surface(number("base_color", "1, 2", "color3")), "", "'1, 2', which is no color3"),
    "includes itself": ('<xi:include href="looks.mtlx" xmlns:xi="http://www.w3.org/2001/XInclude"/>', "", "includes itself"),
    "interface in a circle": (
        '<nodegraph name="G"><input name="a" type="float" nodegraph="G" output="o"/><output name="o" type="float" interfacename="a"/></nodegraph>'
        + surface('<input name="base" type="float" nodegraph="G" output="o"/>'), "", "fed by itself",
    ),
    "nodes in a circle": (
        '<multiply name="A" type="color3"><input name="in1" type="color3" nodename="A"/></multiply>'
        + surface('<input name="base_color" type="color3" nodename="A"/>'), "", "circle",
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", BROKEN)
def test_broken_documents(tmp_path: Path, name: str) -> None:
    document, target, words = BROKEN[name]
    with pytest.raises(InputError, match=words):
        converted(tmp_path, document, target)
    found = converted(tmp_path, document, target, keep_going=True)
    assert any(x.kind == "failed" for x in found.report.losses)


def test_missing_documents(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "stage.usda").write_text(STAGE.format(target="", bound="/looks/Materials/M"))
    with pytest.raises(InputError, match="/looks: .*looks.mtlx"):
        convert_file(tmp_path / "stage.usda", tmp_path / "out.json")
    # Said once, by us.
    assert capfd.readouterr().err == ""


def test_variants_may_refer_to_documents(tmp_path: Path) -> None:
    (tmp_path / "looks.mtlx").write_text(HEAD.format("") + surface(number("coat", 0.5)) + "\n</materialx>")
    stage = STAGE.format(target="", bound="/looks/Materials/M").replace(
        "    references = @./looks.mtlx@\n", '    variants = { string v = "a" }\n    prepend variantSets = "v"\n'
    )
    body = '    variantSet "v" = {\n "a" (references = @./looks.mtlx@) {\n}\n "b" {\n}\n }\n'
    (tmp_path / "stage.usda").write_text(stage.replace("{\n}", "{\n" + body + "}", 1))
    assert material(convert_file(tmp_path / "stage.usda", tmp_path / "out.json"))["params"]["clearcoat"] == 0.5
    other = convert_file(tmp_path / "stage.usda", tmp_path / "out.json", variants=(("/looks", "v", "b"),))
    assert material(other)["plugin"] == "diffuse"
