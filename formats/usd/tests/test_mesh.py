"""Meshes: orientation, holes, normals, primvars of every interpolation, subsets, deduplication."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import area_vectors

QUADS = """
    int[] faceVertexCounts = [4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 0), (2, 1, 0)]
    uniform token subdivisionScheme = "none"
"""


def textured(extra: str, bound: str = "st") -> str:
    """Two quads with a material that reads texture coordinates."""
    return f"""
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    {QUADS}
    {extra}
    rel material:binding = </mat>
}}
def Material "mat" {{
    token outputs:surface.connect = </mat/s.outputs:surface>
    def Shader "s" {{
        uniform token info:id = "UsdPreviewSurface"
        color3f inputs:diffuseColor.connect = </mat/t.outputs:rgb>
        token outputs:surface
    }}
    def Shader "t" {{
        uniform token info:id = "UsdUVTexture"
        asset inputs:file = @texture.png@
        float2 inputs:st.connect = </mat/r.outputs:result>
        float3 outputs:rgb
    }}
    def Shader "r" {{
        uniform token info:id = "UsdPrimvarReader_float2"
        string inputs:varname = "{bound}"
        float2 outputs:result
    }}
}}
"""


def test_left_handed_faces_are_turned(convert_text) -> None:
    for orientation, z in (("rightHanded", 1), ("leftHanded", -1)):
        found = convert_text(f'def Mesh "m" {{ {QUADS} uniform token orientation = "{orientation}"; }}')
        (mesh,) = found.meshes()
        assert np.allclose(area_vectors(mesh), [0, 0, 0.5 * z])


def test_mirroring_transforms_stay_in_the_matrix(convert_text) -> None:
    found = convert_text(
        f'def Mesh "m" {{ {QUADS} float3 xformOp:scale = (-1, 1, 1); uniform token[] xformOpOrder = ["xformOp:scale"]; }}'
    )
    (shape,) = found.scene["shapes"]
    assert np.linalg.det(np.array(shape["transform"])[:3, :3]) < 0
    assert np.allclose(area_vectors(found.mesh(shape)), [0, 0, 0.5])


def test_holes_are_left_out(convert_text) -> None:
    found = convert_text(f'def Mesh "m" {{ {QUADS} int[] holeIndices = [0]; }}')
    (mesh,) = found.meshes()
    assert mesh["POSITION"][:, 0].min() == 1 and len(mesh["triangles"]) == 2


NORMALS = {
    "constant": ("[(0, 3, 4)]", lambda v, f: (0, 0.6, 0.8)),
    "uniform": ("[(1, 0, 0), (0, 1, 0)]", lambda v, f: [(1, 0, 0), (0, 1, 0)][f]),
    "vertex": ("[(1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)]", lambda v, f: [
        (1, 0, 0), (0, 1, 0), (0, 0, 1), (-1, 0, 0), (0, -1, 0), (0, 0, -1)][v]),
}  # fmt: skip
NORMALS["varying"] = NORMALS["vertex"]


@pytest.mark.parametrize("kind", NORMALS)
def test_normals(convert_text, kind: str) -> None:
    text, at = NORMALS[kind]
    found = convert_text(f'def Mesh "m" {{ {QUADS} normal3f[] normals = {text} (interpolation = "{kind}"); }}')
    (mesh,) = found.meshes()
    for k, triangle in enumerate(mesh["triangles"]):
        for corner in triangle:
            x, y, _ = mesh["POSITION"][corner]
            assert np.allclose(mesh["NORMAL"][corner], at(int(x + 3 * y), k // 2), atol=1e-7)


def test_normals_primvar_comes_first(convert_text) -> None:
    found = convert_text(
        f'def Mesh "m" {{ {QUADS} normal3f[] normals = [(1, 0, 0)] (interpolation = "constant"); '
        ' normal3f[] primvars:normals = [(0, 0, -1)] (interpolation = "constant"); }'
    )
    assert np.allclose(found.meshes()[0]["NORMAL"], [0, 0, -1])
    assert not found.losses("/m")


UVS = [(0.0, 0.25), (0.5, 0.0), (1.0, 0.5), (0.25, 1.0), (0.75, 0.75), (2.0, -1.0), (3.0, 0.125), (0.0, 0.5)]
CORNERS = [0, 1, 4, 3, 1, 2, 5, 4]


def uv_of(mesh: dict, face: int, point: int) -> np.ndarray:
    for k, triangle in enumerate(mesh["triangles"]):
        for corner in triangle:
            x, y, _ = mesh["POSITION"][corner]
            if k // 2 == face and int(x + 3 * y) == point:
                return mesh["TEXCOORD_0"][corner]
    raise AssertionError


@pytest.mark.parametrize(
    ("values", "indices", "kind", "expected"),
    [
        (UVS[:1], None, "constant", lambda c, p, f: UVS[0]),
        (UVS[:2], None, "uniform", lambda c, p, f: UVS[f]),
        (UVS[:2], [1, 0], "uniform", lambda c, p, f: UVS[1 - f]),
        (UVS[:6], None, "vertex", lambda c, p, f: UVS[p]),
        (UVS[:3], [2, 1, 0, 2, 2, 0], "varying", lambda c, p, f: UVS[[2, 1, 0, 2, 2, 0][p]]),
        (UVS, None, "faceVarying", lambda c, p, f: UVS[c]),
        (UVS[:4], [0, 1, 2, 3, 3, 2, 1, 0], "faceVarying", lambda c, p, f: UVS[[0, 1, 2, 3, 3, 2, 1, 0][c]]),
    ],
)
def test_texture_coordinates(convert_text, values, indices, kind, expected) -> None:
    text = f'texCoord2f[] primvars:st = {values} (interpolation = "{kind}")'
    if indices is not None:
        text += f"; int[] primvars:st:indices = {indices}"
    found = convert_text(textured(text), keep_going=True)
    meshes = [m for m in found.meshes() if "TEXCOORD_0" in m]
    if not meshes:
        pytest.fail("the material's texture coordinates are not read")
    for corner, point in enumerate(CORNERS):
        face = corner // 4
        assert np.allclose(uv_of(meshes[0], face, point), expected(corner, point, face), atol=1e-6)


def test_shared_corners_are_welded(convert_text) -> None:
    """faceVarying values that agree at points split nothing; where they differ, only that point."""
    same = [UVS[p] for p in CORNERS]
    found = convert_text(textured(f'texCoord2f[] primvars:st = {same} (interpolation = "faceVarying")'), keep_going=True)
    assert len(found.meshes()[0]["POSITION"]) == 6
    same[4] = (9, 9)
    found = convert_text(textured(f'texCoord2f[] primvars:st = {same} (interpolation = "faceVarying")'), keep_going=True)
    assert len(found.meshes()[0]["POSITION"]) == 7


def test_primvars_of_wrong_length_are_reported(convert_text) -> None:
    found = convert_text(f'def Mesh "m" {{ {QUADS} normal3f[] normals = [(1, 0, 0), (0, 1, 0)] (interpolation = "vertex"); }}')
    assert "NORMAL" not in found.meshes()[0]
    assert any("2 vertex elements" in x for x in found.losses("/m"))


def test_subsets_part_the_mesh(convert_text) -> None:
    found = convert_text(f"""
def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{ {QUADS}
    uniform token subsetFamily:materialBind:familyType = "nonOverlapping"
    rel material:binding = </a>
    def GeomSubset "right" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
        uniform token elementType = "face"
        uniform token familyName = "materialBind"
        int[] indices = [1]
        rel material:binding = </b>
    }}
}}
def Material "a" {{ token outputs:surface.connect = </a/s.outputs:surface>
    def Shader "s" {{ uniform token info:id = "UsdPreviewSurface"; color3f inputs:diffuseColor = (1, 0, 0); token outputs:surface; }} }}
def Material "b" {{ token outputs:surface.connect = </b/s.outputs:surface>
    def Shader "s" {{ uniform token info:id = "UsdPreviewSurface"; color3f inputs:diffuseColor = (0, 0, 1); token outputs:surface; }} }}
""")
    a, b = found.scene["shapes"]
    assert found.mesh(a)["POSITION"][:, 0].max() == 1 and found.mesh(b)["POSITION"][:, 0].min() == 1
    assert a["material"] != b["material"]


def test_equal_meshes_share_a_file(convert_text) -> None:
    found = convert_text(f'def Mesh "a" {{ {QUADS} }} def Mesh "a2" {{ {QUADS} }} def Xform "g" {{ def Mesh "a" {{ {QUADS} }} }}')
    files = {s["file"] for s in found.scene["shapes"]}
    assert len(found.scene["shapes"]) == 3 and len(files) <= 2
    contents = {found.path(f).read_bytes() for f in files}
    assert len(contents) == 1


@pytest.mark.parametrize("kind", ["uniform", "vertex", "faceVarying"])
def test_display_colors_of_corners(convert_text, kind: str) -> None:
    count = {"uniform": 2, "vertex": 6, "faceVarying": 8}[kind]
    colors = [(round(0.1 * k, 3), 0.5, 1.0) for k in range(count)]
    found = convert_text(
        f'def Mesh "m" {{ {QUADS} color3f[] primvars:displayColor = {colors} (interpolation = "{kind}"); '
        f'float[] primvars:displayOpacity = [0.5]; }} '
    )
    (mesh,) = found.meshes()
    for k, triangle in enumerate(mesh["triangles"]):
        for corner in triangle:
            x, y, _ = mesh["POSITION"][corner]
            point, face = int(x + 3 * y), k // 2
            at = {"uniform": face, "vertex": point, "faceVarying": 4 * face + CORNERS[4 * face : 4 * face + 4].index(point)}[kind]
            assert np.allclose(mesh["COLOR_0"][corner], [*colors[at], 0.5])
    material = found.scene["materials"][found.scene["shapes"][0]["material"]]
    names = [material["params"]["opacity"]["texture"], material["params"]["bsdf"]["params"]["reflectance"]["texture"]]
    assert [found.scene["textures"][n] for n in names] == [{"vertex_color": True, "channel": "a"}, {"vertex_color": True}]
    assert {x.what for x in found.report.losses} == {"camera"}


def test_display_color(convert_text) -> None:
    found = convert_text(
        f'def Mesh "m" {{ {QUADS} color3f[] primvars:displayColor = [(1, 0.5, 0)]; float[] primvars:displayOpacity = [0.25]; }} '
        f'def Xform "x" {{ color3f[] primvars:displayColor = [(0, 0, 1)]; def Mesh "n" {{ {QUADS} }} }} '
    )
    first, second = (found.scene["materials"][s["material"]] for s in found.scene["shapes"])
    assert first == {"plugin": "mask", "params": {
        "opacity": 0.25, "bsdf": {"plugin": "diffuse", "params": {"reflectance": [1, 0.5, 0]}}}}  # fmt: skip
    assert second["params"]["reflectance"] == [0, 0, 1]
    assert not found.report.losses[1:], "only the camera is missing"
