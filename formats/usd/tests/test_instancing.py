"""Instances: native ones, point instancers, nested ones, and what makes copies differ."""

from __future__ import annotations

import numpy as np
import pytest
from resolvent_usd.report import InputError

QUAD = """
    int[] faceVertexCounts = [4]
    int[] faceVertexIndices = [0, 1, 2, 3]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (1, 1, 0), (0, 1, 0)]
    uniform token subdivisionScheme = "none"
"""

INSTANCER = """
def PointInstancer "pi" {
    point3f[] positions = [(0, 0, 0), (5, 0, 0), (0, 5, 0), (0, 0, 5)]
    int[] protoIndices = [0, 1, 0, 1]
    rel prototypes = [</pi/a>, </pi/b>]
    %s
    def Sphere "a" { double radius = 1 }
    def Mesh "b" { double3 xformOp:translate = (0.5, 0, 0); uniform token[] xformOpOrder = ["xformOp:translate"]; """ + QUAD + """ }
}
"""


def matrices(found, kind: str) -> np.ndarray:
    return np.array([m @ np.array(s.get("transform", np.eye(4))) for s, m in found.copies() if s["type"] == kind])


def test_point_instancer(convert_text) -> None:
    found = convert_text(INSTANCER % """
    quath[] orientations = [(1, 0, 0, 0), (0, 0, 0, 1), (1, 0, 0, 0), (1, 0, 0, 0)]
    float3[] scales = [(1, 1, 1), (1, 2, 1), (3, 1, 1), (1, 1, 1)]""")
    # Half a turn about z, scaled before, with the prototype's own translation inside.
    expected = np.array([[-1, 0, 0, 4.5], [0, -2, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]])
    first, second = matrices(found, "gltf")
    assert np.allclose(first, expected, atol=1e-3) and np.allclose(second[:3, 3], [0.5, 0, 5])
    assert np.allclose(matrices(found, "sphere")[1], np.diag([3, 1, 1, 1]) + np.array([[0] * 4, [0, 0, 0, 5], [0] * 4, [0] * 4]))
    assert len(found.scene["prototypes"]) == 2 and not found.scene.get("shapes")


def test_invisible_ids_and_ids(convert_text) -> None:
    found = convert_text(INSTANCER % "int64[] ids = [7, 8, 9, 10]; int64[] invisibleIds = [8, 9]")
    assert len(matrices(found, "sphere")) == 1 and len(matrices(found, "gltf")) == 1
    assert not [x for x in found.report.losses if x.path == "/pi"]


def test_many_instances_go_to_a_table(convert_text) -> None:
    n = 100
    rng = np.random.default_rng(3)
    positions = [tuple(round(float(x), 4) for x in p) for p in rng.uniform(-9, 9, (n, 3))]
    found = convert_text(f"""
def PointInstancer "pi" {{
    double3 xformOp:translate = (0, 100, 0)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    point3f[] positions = {positions}
    int[] protoIndices = {[0] * n}
    rel prototypes = [</pi/a>]
    def Sphere "a" {{ double radius = 1 }}
}}""")
    (instance,) = found.scene["instances"]
    assert instance["transforms"].endswith(".npy")
    assert np.allclose(matrices(found, "sphere")[:, :3, 3], np.array(positions) + [0, 100, 0], atol=1e-4)


def test_nested_instancers_multiply_out(convert_text) -> None:
    found = convert_text("""
def PointInstancer "outer" {
    point3f[] positions = [(0, 0, 0), (10, 0, 0), (20, 0, 0)]
    int[] protoIndices = [0, 0, 0]
    rel prototypes = [</outer/inner>]
    def PointInstancer "inner" {
        point3f[] positions = [(0, 1, 0), (0, 2, 0)]
        int[] protoIndices = [0, 0]
        rel prototypes = [</outer/inner/s>]
        def Sphere "s" { double radius = 0.5; }
    }
}""")
    centres = matrices(found, "sphere")[:, :3, 3]
    assert sorted(map(tuple, centres.tolist())) == [(x, y, 0) for x in (0.0, 10.0, 20.0) for y in (1.0, 2.0)]


def test_native_instances_share_a_prototype_unless_they_look_different(convert_text) -> None:
    found = convert_text("""
over "asset" { def Mesh "m" {""" + QUAD + """ } def Xform "x" { def Sphere "s" { double radius = 1 } } }
def Xform "world" {
    def "a" (instanceable = true; references = </asset>) { }
    def "b" (instanceable = true; references = </asset>) { }
    def Xform "red" {
        color3f[] primvars:displayColor = [(1, 0, 0)]
        def "c" (instanceable = true; references = </asset>) { }
    }
}""")
    prototypes = found.scene["prototypes"]
    colours = {found.scene["materials"][s["material"]]["params"]["reflectance"][1] for p in prototypes.values() for s in p}
    assert len(prototypes) == 2 and len(found.scene["instances"]) == 3
    assert colours == {0.18, 0.0}
    assert len(list(found.copies())) == 6


def test_lights_in_instances_are_lights_each(convert_text) -> None:
    found = convert_text("""
over "asset" { def SphereLight "l" { float inputs:radius = 0.5; float inputs:intensity = 3; } }
def Xform "world" {
    def Xform "a" (instanceable = true; references = </asset>) {
        double3 xformOp:translate = (1, 0, 0); uniform token[] xformOpOrder = ["xformOp:translate"] }
    def Xform "b" (instanceable = true; references = </asset>) {
        double3 xformOp:translate = (2, 0, 0); uniform token[] xformOpOrder = ["xformOp:translate"] }
}""")
    lights = [s for s in found.scene["shapes"] if "emission" in s]
    assert sorted(s["center"][0] for s in lights) == [1, 2]


def test_cyclic_prototypes_end_in_an_error(convert_text) -> None:
    with pytest.raises(InputError, match="never end"):
        convert_text("""
def PointInstancer "pi" {
    point3f[] positions = [(0, 0, 0)]
    int[] protoIndices = [0]
    rel prototypes = [</x>]
}
def Xform "x" {
    def PointInstancer "again" {
        point3f[] positions = [(0, 0, 0)]
        int[] protoIndices = [0]
        rel prototypes = [</x>]
    }
}""")


@pytest.mark.parametrize(
    ("extra", "words"),
    [
        ("float3[] scales = [(1, 1, 1)]", "scales: has 1 elements for 4 instances"),
        ("int[] protoIndices = [0, 1, 0, 2]", "protoIndices: names prototype 2 of 2"),
        ("float3[] scales = [(1, 1, 1), (nan, 1, 1), (1, 1, 1), (1, 1, 1)]", "not finite"),
    ],
)
def test_wrong_instancers_name_the_attribute(convert_text, extra: str, words: str) -> None:
    text = INSTANCER % extra
    if "protoIndices" in extra:
        text = text.replace("    int[] protoIndices = [0, 1, 0, 1]\n", "", 1)
    with pytest.raises(InputError, match="/pi.*" + words):
        convert_text(text)
    found = convert_text(text, keep_going=True)
    assert [x.kind for x in found.report.losses if x.path.startswith("/pi")] == ["failed"]


@pytest.mark.parametrize("interpolation", ["vertex", "varying", "uniform"])
def test_colours_per_instance_are_reported(convert_text, interpolation: str) -> None:
    """The scene has one look for all copies of a prototype: the instancer's values are a loss, by path, and no error."""
    colors = f'color3f[] primvars:displayColor = [(1, 0, 0), (0, 1, 0), (0, 0, 1), (1, 1, 0)] (interpolation = "{interpolation}")'
    found = convert_text(INSTANCER % colors)
    assert [x for x in found.losses("/pi")] == ["primvars:displayColor: values per instance are not there"]
    assert len(list(found.copies())) == 4


def test_native_instances_have_their_own_colours(convert_text) -> None:
    """displayColor of the instance itself, and a primvar that its material reads: a prototype for each that differs."""
    found = convert_text("""
over "asset" (prepend apiSchemas = ["MaterialBindingAPI"]) {
    def Mesh "m" {""" + QUAD + """ }
    def Mesh "n" (prepend apiSchemas = ["MaterialBindingAPI"]) {""" + QUAD + """; rel material:binding = </asset/mat>; }
    def Material "mat" {
        token outputs:surface.connect = </asset/mat/s.outputs:surface>
        def Shader "s" {
            uniform token info:id = "UsdPreviewSurface"
            float inputs:roughness.connect = </asset/mat/r.outputs:result>
            token outputs:surface
        }
        def Shader "r" { uniform token info:id = "UsdPrimvarReader_float"; string inputs:varname = "rough"; float outputs:result; }
    }
}
def Xform "world" {
    def "a" (instanceable = true; references = </asset>) { color3f[] primvars:displayColor = [(1, 0, 0)]; float primvars:rough = 0.25; }
    def "b" (instanceable = true; references = </asset>) { color3f[] primvars:displayColor = [(0, 1, 0)]; float primvars:rough = 0.75; }
    def "c" (instanceable = true; references = </asset>) { color3f[] primvars:displayColor = [(0, 1, 0)]; float primvars:rough = 0.75; }
}""")
    materials = [found.scene["materials"][s["material"]]["params"] for s, _ in found.copies()]
    assert sorted(m["reflectance"] for m in materials if "reflectance" in m) == [[0, 1, 0], [0, 1, 0], [1, 0, 0]]
    assert sorted(m["roughness"] for m in materials if "roughness" in m) == [0.25, 0.75, 0.75]
    assert len(found.scene["prototypes"]) == 2 and not [x for x in found.report.losses if x.what != "camera"]
