"""Implicit shapes, curves and points: extents as USD computes them, closed surfaces, volumes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from conftest import Converted, area_vectors, convert_stage
from pxr import Usd, UsdGeom

SHAPES = [
    ("Cube", {"size": 3.0}, 27.0),
    ("Sphere", {"radius": 2.0}, None),
    ("Cylinder", {"radius": 0.5, "height": 3.0}, np.pi * 0.25 * 3),
    ("Cone", {"radius": 0.5, "height": 3.0}, np.pi * 0.25),
    ("Capsule", {"radius": 0.5, "height": 3.0}, np.pi * 0.25 * 3 + 4 / 3 * np.pi / 8),
    ("Cylinder_1", {"radiusBottom": 0.5, "radiusTop": 1.0, "height": 3.0}, np.pi * (0.25 + 0.5 + 1.0)),
    ("Capsule_1", {"radiusBottom": 0.5, "radiusTop": 0.5, "height": 3.0}, np.pi * 0.25 * 3 + 4 / 3 * np.pi / 8),
    ("Plane", {"width": 3.0, "length": 5.0}, None),
]


def one(kind: str, values: dict, folder: Path) -> tuple[Converted, Usd.Prim]:
    stage = Usd.Stage.CreateInMemory()
    prim = stage.DefinePrim("/shape", kind)
    for name, value in values.items():
        prim.GetAttribute(name).Set(value)
    return convert_stage(stage, folder / "out.json"), prim


@pytest.mark.parametrize("axis", ["X", "Y", "Z"])
@pytest.mark.parametrize(("kind", "values", "volume"), SHAPES)
def test_extent_and_volume(kind: str, values: dict, volume: float | None, axis: str, tmp_path: Path) -> None:
    if kind in ("Cube", "Sphere"):
        if axis != "X":
            pytest.skip("has no axis")
    else:
        values = {**values, "axis": axis}
    found, prim = one(kind, values, tmp_path)
    lo, hi = UsdGeom.Boundable.ComputeExtentFromPlugins(UsdGeom.Boundable(prim), Usd.TimeCode.Default())
    p = found.points()
    assert np.allclose([p.min(axis=0), p.max(axis=0)], [lo, hi], atol=1e-6)
    if volume is None:
        return
    (mesh,) = found.meshes()
    corners = mesh["POSITION"].astype(float)[mesh["triangles"]]
    inside = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    # Positive: all faces look outwards. A polygon of 128 sides has 0.04 % less area than its circle.
    assert inside == pytest.approx(volume, rel=1e-3)
    areas = area_vectors(mesh)
    assert np.allclose(areas.sum(axis=0), 0, atol=1e-5), "closed"
    if "NORMAL" in mesh:
        smooth = mesh["NORMAL"][mesh["triangles"]].sum(axis=1)
        assert (np.einsum("ij,ij->i", smooth, areas) > 0).all()


def test_plane_faces_along_its_axis(tmp_path: Path) -> None:
    for k, axis in enumerate("XYZ"):
        found, _ = one("Plane", {"axis": axis}, tmp_path)
        normal = area_vectors(found.meshes()[0]).sum(axis=0)
        assert normal[k] == pytest.approx(4.0)


def test_stretched_spheres_are_exact_ellipsoids(convert_text) -> None:
    found = convert_text("""
def Sphere "s" { double radius = 2; double3 xformOp:scale = (1, 2, 3); uniform token[] xformOpOrder = ["xformOp:scale"] }
def Sphere "t" { double radius = 2; double3 xformOp:scale = (3, -3, 3); uniform token[] xformOpOrder = ["xformOp:scale"] }
""")
    (shape,) = found.scene["shapes"]
    assert shape["radius"] == pytest.approx(6)
    ((stretched, matrix),) = [(s, m) for s, m in found.copies() if s is not shape]
    assert stretched["radius"] == 2 and np.allclose(matrix, np.diag([1, 2, 3, 1]))


def test_points_are_spheres_of_their_widths(convert_text) -> None:
    found = convert_text('def Points "p" { point3f[] points = [(0, 0, 0), (4, 0, 0)]; float[] widths = [1, 3] }')
    (low, high) = found.points()[0::2], found.points()[1::2]
    assert np.allclose(high - low, [[1] * 3, [3] * 3]) and np.allclose((high + low) / 2, [[0, 0, 0], [4, 0, 0]])


CURVES = """def BasisCurves "c" {
    uniform token type = "%s"; uniform token basis = "%s"; uniform token wrap = "%s"
    int[] curveVertexCounts = [%d]
    point3f[] points = %s
    float[] widths = [0.2] (interpolation = "constant")
}"""


@pytest.mark.parametrize(
    ("basis", "points", "at"),
    [
        # Middle of the segment, by the bases' own formulas.
        ("bezier", [(0, 0, 0), (0, 8, 0), (8, 8, 0), (8, 0, 0)], (4, 6)),
        ("bspline", [(0, 0, 0), (0, 6, 0), (6, 6, 0), (6, 0, 0)], (3, (0 + 23 * 6 + 23 * 6 + 0) / 48)),
        ("catmullRom", [(0, 0, 0), (0, 8, 0), (8, 8, 0), (8, 0, 0)], (4, 9)),
    ],
)
def test_cubic_curves(convert_text, basis: str, points: list, at: tuple) -> None:
    found = convert_text(CURVES % ("cubic", basis, "nonperiodic", 4, points))
    (mesh,) = found.meshes()
    rings = mesh["POSITION"].reshape(-1, 6, 3)
    assert np.allclose(rings.mean(axis=1)[len(rings) // 2][:2], at, atol=1e-5)
    assert np.allclose(np.linalg.norm(rings - rings.mean(axis=1, keepdims=True), axis=2), 0.1, atol=1e-5)
    assert np.isclose(np.einsum("ij,ij->i", mesh["NORMAL"][mesh["triangles"]].sum(axis=1), area_vectors(mesh)) > 0, True).all()


def test_pinned_curves_reach_their_ends_and_periodic_ones_close(convert_text) -> None:
    points = [(0, 0, 0), (1, 2, 0), (3, 2, 1), (4, 0, 0), (2, -3, 0)]
    for basis in ("bspline", "catmullRom"):
        (mesh,) = convert_text(CURVES % ("cubic", basis, "pinned", 5, points)).meshes()
        rings = mesh["POSITION"].reshape(-1, 6, 3).mean(axis=1)
        assert np.allclose(rings[[0, -1]], [points[0], points[-1]], atol=1e-5)
        (mesh,) = convert_text(CURVES % ("cubic", basis, "periodic", 5, points)).meshes()
        assert len(mesh["POSITION"]) == 5 * 8 * 6 and len(mesh["triangles"]) == 5 * 8 * 6 * 2
        # Closed: every edge belongs to two triangles.
        t = mesh["triangles"].astype(int)
        edges = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
        assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()


def test_curves_with_normals_are_ribbons(convert_text) -> None:
    found = convert_text(
        (CURVES % ("linear", "bezier", "nonperiodic", 3, [(0, 0, 0), (1, 0, 0), (2, 0, 0)])).replace(
            "float[] widths", "normal3f[] normals = [(0, 0, 1), (0, 0, 1), (0, 0, 1)]; float[] widths"
        )
    )
    (mesh,) = found.meshes()
    assert np.allclose(area_vectors(mesh).sum(axis=0), [0, 0, 0.4], atol=1e-6)
    assert np.ptp(mesh["POSITION"][:, 1]) == pytest.approx(0.2)
