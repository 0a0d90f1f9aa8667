"""Surface materials: what is bound, and what its shaders become."""

from __future__ import annotations

import itertools
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, Converted, convert_file
from renders import write_png

from resolvent_usd.report import InputError

_numbers = itertools.count()
QUAD = """
def Mesh "q" (prepend apiSchemas = ["MaterialBindingAPI"]) {
  rel material:binding = </m>
  int[] faceVertexCounts = [4]
  int[] faceVertexIndices = [0, 1, 2, 3]
  point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
  texCoord2f[] primvars:st = [(0, 0), (1, 0), (1, 1), (0, 1)] (
    interpolation = "vertex"
  )
  color3f[] primvars:tint = [(0.25, 0.5, 0.75)]
  uniform token subdivisionScheme = "none"
}
"""


def lines(text: str) -> str:
    """Statements of one line, separated by semicolons, on lines of their own."""
    return text.replace("; ", "\n").replace("{ ", "{\n").replace(" }", "\n}")


def stage(folder: Path, body: str, **options: Any) -> Converted:
    source = folder / f"stage{next(_numbers)}.usda"
    source.write_text("#usda 1.0\n" + body)
    return convert_file(source, folder / "out.json", **options)


def surface(folder: Path, inputs: str, others: str = "", kind: str = "UsdPreviewSurface") -> tuple[dict[str, Any], Converted]:
    """The material of a quad with a shader of these inputs."""
    shader = f'def Shader "s" {{ uniform token info:id = "{kind}"; {inputs}; token outputs:surface }}'
    body = f'def Material "m" {{ token outputs:surface.connect = </m/s.outputs:surface>; {shader}; {others} }}'
    converted = stage(folder, QUAD + lines(body))
    (shape,) = converted.scene["shapes"]
    return converted.scene["materials"][shape["material"]], converted


def image(folder: Path) -> None:
    write_png(folder / "t.png", np.zeros((2, 2, 3)))


TEXTURE = 'def Shader "t" {{ uniform token info:id = "UsdUVTexture"; asset inputs:file = @./t.png@; {}; float3 outputs:rgb; float outputs:r; float outputs:a }}'


def textured(folder: Path, connection: str, settings: str, others: str = "") -> tuple[dict[str, Any], dict[str, Any], Converted]:
    image(folder)
    material, converted = surface(folder, connection, TEXTURE.format(settings) + "; " + others)
    (texture,) = converted.scene["textures"].values()
    assert converted.path(texture["file"]).name == "t.png"
    return material, texture, converted


def test_metallic_workflow(tmp_path: Path) -> None:
    material, converted = surface(
        tmp_path,
        "color3f inputs:diffuseColor = (0.1, 0.2, 0.3); float inputs:metallic = 0.4; float inputs:roughness = 0.6; "
        "float inputs:ior = 1.4; float inputs:clearcoat = 0.7; float inputs:clearcoatRoughness = 0.2; color3f inputs:specularColor = (1, 0, 0)",
    )
    assert material["plugin"] == "principled"
    want = {"metallic": 0.4, "roughness": 0.6, "ior": 1.4, "clearcoat": 0.7, "clearcoat_roughness": 0.2, "clearcoat_ior": 1.4}
    params = material["params"]
    assert params.pop("base_color") == pytest.approx([0.1, 0.2, 0.3])
    assert params == pytest.approx(want)
    assert converted.losses("/m/s") == []


def test_specular_workflow_and_fallbacks(tmp_path: Path) -> None:
    params = surface(tmp_path, "int inputs:useSpecularWorkflow = 1; color3f inputs:specularColor = (0.9, 0.6, 0.3); float inputs:metallic = 1")[0]["params"]
    assert params["f0"] == pytest.approx([0.9, 0.6, 0.3]) and "metallic" not in params
    assert params["base_color"] == pytest.approx(0.18) and "roughness" not in params
    assert surface(tmp_path, "int inputs:useSpecularWorkflow = 1")[0]["params"]["f0"] == 0.0


def test_opacity(tmp_path: Path) -> None:
    """Constants are glass, thresholds and presence are holes, textures are holes and said to be."""
    glass = surface(tmp_path, "float inputs:opacity = 0.25; float inputs:ior = 1.33")[0]
    assert glass["params"]["transmission"] == 0.75 and glass["params"]["transmission_color"] == 1 and glass["params"]["ior"] == pytest.approx(1.33)
    cut = surface(tmp_path, "float inputs:opacity = 0.25; float inputs:opacityThreshold = 0.5")[0]
    assert cut["plugin"] == "mask" and cut["params"]["opacity"] == 0.25 and cut["params"]["cutoff"] == 0.5
    part = surface(tmp_path, 'float inputs:opacity = 0.25; token inputs:opacityMode = "presence"')[0]
    assert part["plugin"] == "mask" and "cutoff" not in part["params"]
    material, texture, converted = textured(tmp_path, "float inputs:opacity.connect = </m/t.outputs:a>", 'token inputs:wrapS = "clamp"')
    assert material["plugin"] == "mask" and texture["channel"] == "a"
    assert any("a texture of opacity" in x for x in converted.losses("/m/s"))


def test_emission_is_the_shapes(tmp_path: Path) -> None:
    _, converted = surface(tmp_path, "color3f inputs:emissiveColor = (0, 2, 4)")
    assert converted.scene["shapes"][0]["emission"] == [0, 2, 4]
    _, texture, converted = textured(tmp_path, "color3f inputs:emissiveColor.connect = </m/t.outputs:rgb>", "float4 inputs:scale = (3, 4, 5, 1)")
    shape = converted.scene["shapes"][0]
    assert shape["emission"] == [1, 1, 1] and converted.scene["textures"][shape["emission_texture"]] == texture
    assert texture["scale"] == [3, 4, 5]


def test_settings_of_textures(tmp_path: Path) -> None:
    reader = (
        'def Shader "x" { uniform token info:id = "UsdTransform2d"; float2 inputs:in.connect = </m/r.outputs:result>; float2 inputs:scale = (2, 3); '
        "float inputs:rotation = 30; float2 inputs:translation = (0.1, 0.2); float2 outputs:result }; "
        'def Shader "r" { uniform token info:id = "UsdPrimvarReader_float2"; string inputs:varname = "st"; float2 outputs:result }'
    )
    material, texture, converted = textured(
        tmp_path,
        "float inputs:roughness.connect = </m/t.outputs:r>",
        'float2 inputs:st.connect = </m/x.outputs:result>; token inputs:wrapS = "mirror"; token inputs:wrapT = "repeat"; '
        'token inputs:sourceColorSpace = "raw"; float4 inputs:scale = (0.5, 1, 1, 1); float4 inputs:bias = (0.25, 0, 0, 0)',
        reader,
    )
    assert material["params"]["roughness"] == {"texture": next(iter(converted.scene["textures"]))}
    transform = texture.pop("uv_transform")
    assert np.allclose(transform["scale"], [2, 3]) and transform["rotation_deg"] == 30 and np.allclose(transform["offset"], [0.1, 0.2])
    texture.pop("file")
    assert texture == {"color_space": "raw", "wrap_u": "mirror", "wrap_v": "repeat", "channel": "r", "scale": 0.5, "bias": 0.25}
    assert converted.losses("/m/t") == [] and converted.losses("/q") == []


def test_textures_without_settings(tmp_path: Path) -> None:
    """Without wrap metadata: black; the colour space is the image's own."""
    texture = textured(tmp_path, "color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>", "float2 inputs:st = (0, 0)")[1]
    assert texture["wrap_u"] == texture["wrap_v"] == "black" and "color_space" not in texture


def test_normal_maps(tmp_path: Path) -> None:
    """Texels times 2 minus 1 are the normal; the scene's normal maps have texels in 0..1."""
    material, texture, _ = textured(
        tmp_path,
        "normal3f inputs:normal.connect = </m/t.outputs:rgb>",
        'float4 inputs:scale = (2, 2, 2, 1); float4 inputs:bias = (-1, -1, -1, 0); token inputs:sourceColorSpace = "raw"',
    )
    assert material["normal_map"]["texture"] in ("m normal",) and texture["color_space"] == "raw"
    assert "scale" not in texture and "bias" not in texture


def test_missing_and_tiled_images(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="/m/t.inputs:file: can't find the file"):
        surface(tmp_path, "color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>", TEXTURE.format("float inputs:x = 0").replace("t.png", "none.png"))
    tiles = TEXTURE.format("float2 inputs:st = (0, 0)").replace("t.png", "wood.<UDIM>.png")
    with pytest.raises(InputError, match="no tile"):
        surface(tmp_path, "color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>", tiles)
    write_png(tmp_path / "wood.1002.png", np.zeros((1, 1, 3)))
    _, converted = surface(tmp_path, "color3f inputs:diffuseColor.connect = </m/t.outputs:rgb>", tiles)
    (texture,) = converted.scene["textures"].values()
    assert texture["file"].endswith("wood.<UDIM>.png")


def test_primvars(tmp_path: Path) -> None:
    """A constant primvar of the prim; its fallback where there is none."""
    reader = 'def Shader "p" {{ uniform token info:id = "UsdPrimvarReader_float3"; string inputs:varname = "{}"; float3 inputs:fallback = (1, 0, 0); float3 outputs:result }}'
    connect = "color3f inputs:diffuseColor.connect = </m/p.outputs:result>"
    material, converted = surface(tmp_path, connect, reader.format("tint"))
    assert material["params"]["base_color"] == pytest.approx([0.25, 0.5, 0.75]) and converted.losses("/q") == []
    assert surface(tmp_path, connect, reader.format("none"))[0]["params"]["base_color"] == [1, 0, 0]


def test_colours_at_corners(tmp_path: Path) -> None:
    """displayColor that varies is read corner by corner; any other primvar that varies by its mean, which is said."""
    reader = 'def Shader "p" {{ uniform token info:id = "UsdPrimvarReader_float3"; string inputs:varname = "{}"; float3 outputs:result }}'
    connect = "color3f inputs:diffuseColor.connect = </m/p.outputs:result>"
    colors = 'color3f[] primvars:{} = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 1)] (\n interpolation = "vertex"\n)\n rel material'
    quad = QUAD.replace("rel material", colors.format("displayColor") .replace("rel material", colors.format("other")))
    shader = 'def Shader "s" {{ uniform token info:id = "UsdPreviewSurface"; {}; token outputs:surface }}'.format(connect)
    for name, exact in (("displayColor", True), ("other", False)):
        body = f'def Material "m" {{ token outputs:surface.connect = </m/s.outputs:surface>; {shader}; {reader.format(name)} }}'
        converted = stage(tmp_path, quad + lines(body))
        (shape,) = converted.scene["shapes"]
        color = converted.scene["materials"][shape["material"]]["params"]["base_color"]
        if exact:
            assert converted.scene["textures"][color["texture"]] == {"vertex_color": True}
            assert "COLOR_0" in converted.mesh(shape) and converted.losses("/q") == []
        else:
            assert color == 0.5 and any("other" in x for x in converted.losses("/q"))


def test_what_has_no_effect_is_said(tmp_path: Path) -> None:
    _, converted = surface(tmp_path, "float inputs:displacement = 0.5; float inputs:occlusion = 0.5; float inputs:frobnication = 1")
    losses = " ".join(converted.losses("/m/s"))
    assert all(f"inputs:{x}" in losses for x in ("displacement", "occlusion", "frobnication"))


def test_unknown_shaders_are_named(tmp_path: Path) -> None:
    material, converted = surface(tmp_path, "float inputs:a = 1", kind="toon")
    assert any("'toon' is unknown" in x for x in converted.losses("/m/s"))
    assert material["plugin"] == "diffuse"


def test_networks_in_a_circle_end(tmp_path: Path) -> None:
    multiply = 'def Shader "{0}" {{ uniform token info:id = "ND_multiply_color3"; color3f inputs:in1.connect = </m/{1}.outputs:out>; color3f outputs:out }}'
    others = multiply.format("a", "b") + "; " + multiply.format("b", "a")
    with pytest.raises(InputError, match="circle"):
        surface(tmp_path, "color3f inputs:base_color.connect = </m/a.outputs:out>", others, "ND_standard_surface_surfaceshader")


def test_standard_surface(tmp_path: Path) -> None:
    image(tmp_path)
    others = (
        'def Shader "i" { uniform token info:id = "ND_image_color3"; asset inputs:file = @./t.png@ ( colorSpace = "srgb_texture" ); '
        'string inputs:uaddressmode = "mirror"; color3f outputs:out }; '
        'def Shader "x" { uniform token info:id = "ND_multiply_color3FA"; color3f inputs:in1.connect = </m/i.outputs:out>; float inputs:in2 = 0.5; color3f outputs:out }'
    )
    material, converted = surface(
        tmp_path,
        "float inputs:base = 0.8; color3f inputs:base_color.connect = </m/x.outputs:out>; float inputs:metalness = 0.1; float inputs:specular_roughness = 0.35; "
        "float inputs:specular_IOR = 1.6; float inputs:coat = 0.9; float inputs:coat_IOR = 1.4; float inputs:sheen = 0.3; color3f inputs:sheen_color = (1, 0.5, 0); "
        "float inputs:emission = 2; color3f inputs:emission_color = (1, 0.5, 0.25); float inputs:subsurface = 0.4; float inputs:thin_film_thickness = 300",
        others,
        "ND_standard_surface_surfaceshader",
    )
    params = material["params"]
    (texture,) = converted.scene["textures"].values()
    assert texture["color_space"] == "srgb" and texture["wrap_u"] == "mirror" and texture["wrap_v"] == "repeat"
    assert texture["scale"] == pytest.approx(0.4)
    assert params["metallic"] == pytest.approx(0.1) and params["roughness"] == pytest.approx(0.35) and params["ior"] == pytest.approx(1.6)
    assert params["clearcoat"] == pytest.approx(0.9) and params["clearcoat_ior"] == pytest.approx(1.4) and params["clearcoat_roughness"] == pytest.approx(0.1)
    assert params["sheen"] == pytest.approx(0.3) and params["sheen_color"] == pytest.approx([1, 0.5, 0])
    assert converted.scene["shapes"][0]["emission"] == [2, 1, 0.5]
    assert params["thin_film"] == 1 and params["thin_film_thickness"] == pytest.approx(300) and params["thin_film_ior"] == pytest.approx(1.5)
    losses = " ".join(converted.losses("/m/s"))
    assert "subsurface" in losses and "thin_film" not in losses


def test_open_pbr(tmp_path: Path) -> None:
    material, converted = surface(
        tmp_path,
        "color3f inputs:base_color = (0.5, 0.4, 0.3); float inputs:base_weight = 0.5; float inputs:transmission_weight = 1; color3f inputs:transmission_color = (0.9, 1, 0.9); "
        "float inputs:specular_ior = 1.33; bool inputs:geometry_thin_walled = 1; float inputs:emission_luminance = 10; float inputs:geometry_opacity = 0.5; "
        "float inputs:base_diffuse_roughness = 0.3; float inputs:coat_weight = 0.5; color3f inputs:coat_color = (1, 0.5, 0.5); "
        "float inputs:base_metalness = 0.5; color3f inputs:specular_color = (0.5, 0.75, 1); color3f inputs:thin_film_weight = (1, 1, 1)",
        kind="ND_open_pbr_surface_surfaceshader",
    )
    assert material["plugin"] == "mask" and material["params"]["opacity"] == 0.5
    params = material["params"]["bsdf"]["params"]
    assert params["base_color"] == pytest.approx([0.25, 0.2, 0.15]) and params["thin"] is True and params["transmission"] == 1
    assert params["transmission_color"] == pytest.approx([0.9, 1, 0.9]) and params["ior"] == pytest.approx(1.33)
    assert converted.scene["shapes"][0]["emission"] == [10, 10, 10]
    assert params["diffuse_roughness"] == pytest.approx(0.3) and params["clearcoat_color"] == [1, 0.5, 0.5] and params["clearcoat_darkening"] == 1
    assert params["edge_color"] == params["specular_color"] == [0.5, 0.75, 1] and params["clearcoat_ior"] == pytest.approx(1.6)
    # Half a micrometre of index 1.4, which is principled's film as well.
    assert params["thin_film"] == 1 and "thin_film_thickness" not in params and "thin_film_ior" not in params
    assert not any("thin_film" in x for x in converted.losses("/m/s"))


def test_thin_films(tmp_path: Path) -> None:
    """OpenPBR's micrometres, also where a texture says how many; without weight or thickness there is no film."""
    image(tmp_path)
    kind = "ND_open_pbr_surface_surfaceshader"
    thickness = 'def Shader "i" { uniform token info:id = "ND_image_float"; asset inputs:file = @./t.png@; float outputs:out }'
    material, converted = surface(
        tmp_path,
        "float inputs:thin_film_weight = 0.75; float inputs:thin_film_thickness.connect = </m/i.outputs:out>; float inputs:thin_film_ior = 1.8",
        thickness,
        kind,
    )
    params = material["params"]
    texture = converted.scene["textures"][params["thin_film_thickness"]["texture"]]
    assert params["thin_film"] == 0.75 and params["thin_film_ior"] == pytest.approx(1.8) and texture["scale"] == pytest.approx(1000)
    material, _ = surface(tmp_path, "float inputs:thin_film_weight = 1; float inputs:thin_film_thickness = 0.35", kind=kind)
    assert material["params"]["thin_film_thickness"] == pytest.approx(350)
    for kind, off in (
        (kind, "float inputs:thin_film_weight = 0; float inputs:thin_film_ior = 2"),
        (kind, "float inputs:thin_film_weight = 1; float inputs:thin_film_thickness = 0"),
        ("ND_standard_surface_surfaceshader", "float inputs:thin_film_thickness = 0; float inputs:thin_film_IOR = 2"),
    ):
        material, converted = surface(tmp_path, off, kind=kind)
        assert not any(name.startswith("thin_film") for name in material["params"]) and not converted.losses("/m/s")
    material, converted = surface(tmp_path, "float inputs:thin_film_weight = 1; float inputs:thin_film_ior = 7", kind="ND_open_pbr_surface_surfaceshader")
    assert material["params"]["thin_film_ior"] == 5 and any("thin_film_ior" in x for x in converted.losses("/m/s"))


BUMPS = """
def Shader "i" { uniform token info:id = "ND_image_vector3"; asset inputs:file = @./t.png@; vector3f outputs:out }
def Shader "n" { uniform token info:id = "ND_normalmap"; vector3f inputs:in.connect = </m/i.outputs:out>; float inputs:scale = 0.5; vector3f outputs:out }
"""


@pytest.mark.parametrize(
    ("kind", "coat", "normal", "coat_normal"),
    [
        ("ND_standard_surface_surfaceshader", "coat", "normal", "coat_normal"),
        ("ND_open_pbr_surface_surfaceshader", "coat_weight", "geometry_normal", "geometry_coat_normal"),
    ],
)
def test_normals_of_coats(tmp_path: Path, kind: str, coat: str, normal: str, coat_normal: str) -> None:
    """They are never the base's: a map of their own, or the surface's."""
    image(tmp_path)

    def params(inputs: str) -> tuple[dict[str, Any], list[str]]:
        material, converted = surface(tmp_path, inputs, BUMPS, kind)
        return material["params"], [x for x in converted.losses("/m/s") if "normal" in x]

    base, own = (f"vector3f inputs:{n}.connect = </m/n.outputs:out>" for n in (normal, coat_normal))
    there = f"float inputs:{coat} = 1"
    assert params(f"{there}; {base}")[0]["clearcoat_normal"] == [0.5, 0.5, 1.0]
    for inputs in (f"{there}; {own}", f"{there}; {base}; {own}"):
        found, losses = params(inputs)
        assert found["clearcoat_normal"]["texture"] in ("m normal", "m coat normal") and found["clearcoat_normal_scale"] == 0.5 and not losses
    for inputs in (there, base, own):
        found, losses = params(inputs)
        assert "clearcoat_normal" not in found and not losses


def mats(*names: str) -> str:
    """Materials that differ in colour alone."""
    return "".join(
        lines(
            f'def Material "{n}" {{ token outputs:surface.connect = </{n}/s.outputs:surface>; '
            f'def Shader "s" {{ uniform token info:id = "UsdPreviewSurface"; color3f inputs:diffuseColor = (0.{i + 1}, 0, 0); token outputs:surface }} }}\n'
        )
        for i, n in enumerate(names)
    )


BALL = 'def Sphere "{}" ( prepend apiSchemas = ["MaterialBindingAPI"] ) {{\n {} \n}}\n'


def material_names(converted: Converted) -> dict[float, str]:
    return {s["radius"]: s["material"] for s in converted.scene["shapes"]}


def test_strength_collections_and_purposes(tmp_path: Path) -> None:
    """The nearest binding wins, unless one above is stronger; collections before direct ones; "full" before all purposes."""
    balls = (
        BALL.format("a", "double radius = 1\n rel material:binding = </m1>")
        + BALL.format("b", "double radius = 2")
        + BALL.format("c", "double radius = 3\n rel material:binding = </m1>\n rel material:binding:full = </m2>\n rel material:binding:preview = </m3>")
    )
    group = 'def Xform "g" ( prepend apiSchemas = ["MaterialBindingAPI", "CollectionAPI:some"] ) {{\n rel material:binding = </m2> {}\n {}\n{}}}\n'
    plain = stage(tmp_path, mats("m1", "m2", "m3") + group.format("", "", balls))
    assert material_names(plain) == {1: "m1", 2: "m2", 3: "m2"}
    strong = '(\n bindMaterialAs = "strongerThanDescendants"\n)'
    stronger = stage(tmp_path, mats("m1", "m2", "m3") + group.format(strong, "", balls))
    assert material_names(stronger)[1] == "m2"
    collection = (
        "uniform bool collection:some:includeRoot = 0\n rel collection:some:includes = </g/b>\n"
        " rel material:binding:collection:some = [</g.collection:some>, </m3>]"
    )
    chosen = stage(tmp_path, mats("m1", "m2", "m3") + group.format("", collection, balls))
    assert material_names(chosen)[2] == "m3" and material_names(chosen)[1] == "m1"


def test_bindings_that_lead_nowhere(tmp_path: Path) -> None:
    converted = stage(tmp_path, BALL.format("a", "rel material:binding = </nothing>"))
    assert any("/nothing, which is no material" in x for x in converted.losses("/a"))


def test_own_stage(tmp_path: Path) -> None:
    """An interface input, a metal on a subset, and glass that nothing uses."""
    converted = convert_file(DATA / "own" / "assembly.usda", tmp_path / "out.json")
    materials = converted.scene["materials"]
    assert materials["grey"]["params"]["roughness"] == pytest.approx(0.35)
    assert materials["metal"]["params"]["metallic"] == 1 and materials["metal"]["params"]["base_color"] == pytest.approx([0.9, 0.6, 0.2])
    assert "glass" not in materials
    metal = [s for s, _ in converted.copies() if s.get("material") == "metal"]
    assert len(metal) == 1 and metal[0]["emission"] == pytest.approx([0.01, 0, 0])


def test_mesh_lights_and_their_materials(tmp_path: Path) -> None:
    """materialGlowTintsLight: the glow times the light; without a glow the mesh does not shine."""
    light = QUAD.replace('["MaterialBindingAPI"]', '["MaterialBindingAPI", "MeshLightAPI"]').replace(
        "rel material", "float inputs:intensity = 3\n color3f inputs:color = (1, 0.5, 0)\n rel material"
    )
    glowing = lines(
        'def Material "m" { token outputs:surface.connect = </m/s.outputs:surface>; '
        'def Shader "s" { uniform token info:id = "UsdPreviewSurface"; color3f inputs:emissiveColor = (2, 2, 2); token outputs:surface } }'
    )
    converted = stage(tmp_path, light + glowing)
    assert converted.scene["shapes"][0]["emission"] == [6, 3, 0]
    assert converted.scene["materials"][converted.scene["shapes"][0]["material"]]["plugin"] == "principled"
    dull = stage(tmp_path, light + mats("m"))
    assert "emission" not in dull.scene["shapes"][0] and any("does not glow" in x for x in dull.losses("/q"))
    bare = stage(tmp_path, light.replace("rel material:binding = </m>", ""))
    assert bare.scene["shapes"][0]["emission"] == [3, 1.5, 0] and bare.scene["materials"]["black"]["params"] == {"reflectance": 0}
