"""Subdivision surfaces against limits that are known in closed form and rules worked out by hand."""

from __future__ import annotations

import numpy as np
import pytest
from conftest import area_vectors
from resolvent_usd.geometry import loop, subdivide
from resolvent_usd.geometry.cage import INFINITE, Cage, following
from resolvent_usd.geometry.normals import smooth_normals
from resolvent_usd.geometry.primvars import Topology
from resolvent_usd.geometry.weld import welds

CUBE = np.array([(x, y, z) for z in (-1, 1) for y in (-1, 1) for x in (-1, 1)], dtype=float)
FACES = np.array([[0, 2, 3, 1], [4, 5, 7, 6], [0, 1, 5, 4], [2, 6, 7, 3], [0, 4, 6, 2], [1, 3, 7, 5]])


def cage(points, faces, creases=(), sharpness=(), corners=None) -> Cage:
    counts = np.array([len(f) for f in faces])
    edges = np.array(creases, dtype=np.int64).reshape(-1, 2)
    corner = np.zeros(len(points)) if corners is None else np.asarray(corners, dtype=float)
    return Cage(
        counts, np.concatenate(faces), np.asarray(points, dtype=float), edges, np.asarray(sharpness, dtype=float), corner,
        np.arange(len(faces)),
    )  # fmt: skip


def grid(n: int) -> tuple[np.ndarray, list]:
    points = np.array([(x, y, 0.0) for y in range(n) for x in range(n)])
    faces = [[y * n + x, y * n + x + 1, (y + 1) * n + x + 1, (y + 1) * n + x] for y in range(n - 1) for x in range(n - 1)]
    return points, faces


def test_cube_by_hand() -> None:
    """Catmull and Clark's rules at valence 3: face (0, 0, 1), edge (0, 3/4, 3/4), vertex 5/9."""
    fine = subdivide.step(cage(CUBE, FACES))
    assert len(fine.counts) == 24 and len(fine.data) == 8 + 12 + 6
    assert np.allclose(fine.data[:8], CUBE * 5 / 9)
    assert np.allclose(np.sort(np.abs(fine.data[8:20]), axis=1), [0, 0.75, 0.75])
    assert np.allclose(np.sort(np.abs(fine.data[20:]), axis=1), [0, 0, 1])


def test_limit_of_the_cube() -> None:
    """The limit of a vertex does not depend on the level: (n² v + 4 Σe + Σf)/(n(n + 5)) on the refined cage, and for the cube's
    corner in closed form from level 1: v = 5/9, e = 3/4, f on the axes."""
    v, e, f = np.array([5 / 9] * 3), np.array([[0, 3 / 4, 3 / 4], [3 / 4, 0, 3 / 4], [3 / 4, 3 / 4, 0]]), np.eye(3)
    expected = (9 * v + 4 * e.sum(axis=0) + f.sum(axis=0)) / 24
    c = cage(CUBE, FACES)
    for _ in range(4):
        c = subdivide.step(c)
        assert np.allclose(subdivide.limit(c).data[7], expected, atol=1e-12)


def test_regular_grid_is_a_bicubic_b_spline() -> None:
    """Interior points of a height field converge to the tensor product of cubic B-splines."""
    points, faces = grid(7)
    rng = np.random.default_rng(1)
    heights = rng.normal(size=(7, 7))
    points[:, 2] = heights.reshape(-1)
    c = cage(points, faces)
    for _ in range(3):
        c = subdivide.step(c)
    c = subdivide.limit(c)
    inside = (np.abs(c.data[:, :2] - 3) < 1.5).all(axis=1)
    assert inside.sum() > 100

    def basis(t: np.ndarray) -> np.ndarray:
        a = np.abs(t)
        return np.where(a < 1, 2 / 3 - a**2 + a**3 / 2, np.where(a < 2, (2 - a) ** 3 / 6, 0))

    x, y = c.data[inside, 0], c.data[inside, 1]
    k = np.arange(7)
    expected = np.einsum("pi,pj,ij->p", basis(y[:, None] - k), basis(x[:, None] - k), heights)
    assert np.allclose(c.data[inside, 2], expected, atol=1e-12)


def test_boundary_is_a_cubic_b_spline_that_ends_at_corners() -> None:
    points, faces = grid(4)
    points[:4, 2] = [0, 1, 3, 0]
    sharp = np.zeros(16)
    sharp[[0, 3, 12, 15]] = INFINITE
    c = cage(points, faces, corners=sharp)
    for _ in range(3):
        c = subdivide.step(c)
    c = subdivide.limit(c)
    assert np.allclose(c.data[[0, 3, 12, 15]], points[[0, 3, 12, 15]])
    # (1 · 4 · 1)/6 at a control point inside the boundary.
    assert np.allclose(c.data[1], (points[0] + 4 * points[1] + points[2]) / 6)
    # Without corners even the ends are smooth: the boundary goes around them.
    c = cage(points, faces)
    assert np.allclose(subdivide.limit(subdivide.step(c)).data[0], (points[1] + 4 * points[0] + points[4]) / 6)


def ring(z: int) -> list:
    a, b, c, d = (4 * z + i for i in (0, 1, 3, 2))
    return [(a, b), (b, c), (c, d), (d, a)]


def test_infinite_crease_is_its_own_b_spline() -> None:
    c = cage(CUBE, FACES, ring(1), [10.0] * 4)
    for _ in range(3):
        c = subdivide.step(c)
    c = subdivide.limit(c)
    # The crease stays in its plane; its vertices go to (e0 + 4 v + e1)/6.
    assert np.allclose(c.data[7], (CUBE[5] + 4 * CUBE[7] + CUBE[6]) / 6)
    # The other side is that of a smooth cube no longer, but still below the crease's plane.
    assert c.data[:, 2].max() == pytest.approx(1.0)


def test_semi_sharp_crease_by_hand() -> None:
    """Sharpness 0.5 on one loop: edge points are half way between the smooth and the sharp rule, and so are vertices."""
    smooth = subdivide.step(cage(CUBE, FACES)).data
    sharp = subdivide.step(cage(CUBE, FACES, ring(1), [10.0] * 4)).data
    half = subdivide.step(cage(CUBE, FACES, ring(1), [0.5] * 4)).data
    assert np.allclose(half, 0.5 * (smooth + sharp))
    # Sharpness 1 is sharp for one level and smooth from then on.
    one = subdivide.step(cage(CUBE, FACES, ring(1), [1.0] * 4))
    assert np.allclose(one.data, sharp) and not one.edges.sharpness.any()
    # 1.5: sharp, then half.
    two = subdivide.step(cage(CUBE, FACES, ring(1), [1.5] * 4))
    assert np.allclose(two.data, sharp) and sorted(two.edges.sharpness)[-9:] == [0] + [0.5] * 8


def test_edges_are_those_of_the_faces() -> None:
    """The edges that a level hands on are the ones that a search finds."""
    points, faces = grid(4)
    mixed = [*faces[1:], [0, 1, 5], [0, 5, 4]]
    for mesh in (cage(CUBE, FACES, ring(1), [2.5] * 4), cage(points, mixed)):
        fine = subdivide.step(subdivide.step(mesh))
        known = fine.edges
        ends = np.sort(np.stack([fine.indices, fine.indices[following(fine.counts)]], axis=1), axis=1)
        assert np.array_equal(np.sort(known.ends[known.of_corner], axis=1), ends)
        assert len(np.unique(ends, axis=0)) == len(known.ends)
        assert np.array_equal(np.bincount(known.of_corner), known.faces)


def test_darts_and_corners() -> None:
    """One sharp edge leaves its ends smooth; three sharp edges make a corner; sharpness 2.4 of a corner lasts two levels and more."""
    dart = subdivide.step(cage(CUBE, FACES, [(6, 7)], [10.0])).data
    smooth = subdivide.step(cage(CUBE, FACES)).data
    assert np.allclose(dart[:8], smooth[:8])
    three = subdivide.step(cage(CUBE, FACES, [(6, 7), (5, 7), (3, 7)], [10.0] * 3)).data
    assert np.allclose(three[7], CUBE[7])
    sharp = np.zeros(8)
    sharp[7] = 2.4
    c = cage(CUBE, FACES, corners=sharp)
    for level in range(3):
        before = c.data[7].copy()
        c = subdivide.step(c)
        assert np.allclose(c.data[7], before) == (level < 2)


def test_normals_break_at_sharp_edges_only() -> None:
    c = cage(CUBE, FACES, ring(1), [10.0] * 4)
    for _ in range(2):
        c = subdivide.step(c)
    normals, which = smooth_normals(c, c.data)
    at: dict[int, set[int]] = {}
    for point, n in zip(c.indices, which, strict=True):
        at.setdefault(int(point), set()).add(int(n))
    on_crease = np.isclose(c.data[:, 2], 1.0) & (np.hypot(c.data[:, 0], c.data[:, 1]) > 0.8)
    for point, sectors in at.items():
        assert len(sectors) == (2 if on_crease[point] else 1), c.data[point]
    assert np.allclose(np.linalg.norm(normals, axis=1), 1)


MESH = """def Mesh "m" {
    int[] faceVertexCounts = [4, 4, 4, 4]
    int[] faceVertexIndices = [0, 1, 4, 3, 1, 2, 5, 4, 3, 4, 7, 6, 4, 5, 8, 7]
    point3f[] points = [(0, 0, 0), (1, 0, 0), (2, 0, 0), (0, 1, 0), (1, 1, 1), (2, 1, 0), (0, 2, 0), (1, 2, 0), (2, 2, 0)]
    %s
}"""


def test_levels_and_boundary_rules_of_stages(convert_text) -> None:
    for level in (1, 2, 3):
        (mesh,) = convert_text(MESH % "", subdivision=level).meshes()
        assert len(mesh["triangles"]) == 2 * 4 * 4**level
    corners = {(0.0, 0.0), (2.0, 2.0)}
    for rule, reached in (("edgeAndCorner", True), ("edgeOnly", False)):
        (mesh,) = convert_text(MESH % f'uniform token interpolateBoundary = "{rule}"').meshes()
        found = {tuple(p) for p in mesh["POSITION"][:, :2].tolist()}
        assert (corners <= found) == reached
    # "none": faces at the boundary are not drawn, which is all of these.
    assert convert_text(MESH % 'uniform token interpolateBoundary = "none"').meshes() == []


def test_left_handed_subdivision_has_outward_normals(convert_text) -> None:
    (mesh,) = convert_text(MESH % 'uniform token orientation = "leftHanded"').meshes()
    assert (area_vectors(mesh)[:, 2] < 0).all() and (mesh["NORMAL"][:, 2] < 0).all()


def test_bilinear_stays_flat(convert_text) -> None:
    (mesh,) = convert_text(MESH % 'uniform token subdivisionScheme = "bilinear"', subdivision=2).meshes()
    assert len(mesh["triangles"]) == 2 * 4 * 16
    assert mesh["POSITION"][:, 2].max() == 1 and "NORMAL" not in mesh


def test_wrong_creases_name_the_prim(convert_text) -> None:
    from resolvent_usd.report import InputError

    for extra, words in (
        ("int[] creaseIndices = [0, 1]; int[] creaseLengths = [3]; float[] creaseSharpnesses = [1]", "creaseLengths"),
        ("int[] creaseIndices = [0, 99]; int[] creaseLengths = [2]; float[] creaseSharpnesses = [1]", "names a point"),
        ("int[] cornerIndices = [0, 1]; float[] cornerSharpnesses = [1]", "2 corners"),
    ):
        with pytest.raises(InputError, match="/m.*" + words):
            convert_text(MESH % extra)


@pytest.mark.parametrize("kinds", [1, 3, 40])
def test_corners_of_a_point_with_equal_values_are_one(kinds: int) -> None:
    """However many different values meet at a point: by a dictionary, and by what the mesh of texture coordinates is made of."""
    rng = np.random.default_rng(kinds)
    indices, values = rng.integers(0, 5, 600), rng.integers(0, kinds, (600, 2)).astype(np.float32)
    first, which = welds(Topology(5, np.full(200, 3), indices), values)
    places: dict[tuple[int, ...], int] = {}
    for corner, key in enumerate(zip(indices, *values.T, strict=True)):
        places.setdefault(key, corner)
        assert first[which[corner]] == places[key]
    assert sorted(places.values()) == first.tolist()


@pytest.mark.parametrize(("level", "scheme"), [(1, "catmullClark"), (3, "catmullClark"), (1, "loop"), (2, "loop")])
def test_texture_coordinates_follow_creases(convert_text, level: int, scheme: str) -> None:
    """Coordinates that are the positions stay the positions, over semi-sharp creases and corners as well (OpenSubdiv's rule for
    face-varying data that are continuous)."""
    rng = np.random.default_rng(4)
    points, faces = grid(5) if scheme == "catmullClark" else triangles(5)
    points += rng.uniform(-0.3, 0.3, points.shape)
    corners = np.concatenate(faces)
    found = convert_text(
        f"""def Mesh "m" (prepend apiSchemas = ["MaterialBindingAPI"]) {{
    int[] faceVertexCounts = {[len(f) for f in faces]}
    uniform token subdivisionScheme = "{scheme}"
    int[] faceVertexIndices = {corners.tolist()}
    point3f[] points = {[tuple(p) for p in points.tolist()]}
    int[] creaseIndices = [6, 7, 8, 13, 12, 11]
    int[] creaseLengths = [3, 3]
    float[] creaseSharpnesses = [1.5, 10]
    int[] cornerIndices = [16, 18]
    float[] cornerSharpnesses = [2.5, 10]
    texCoord2f[] primvars:st = {[tuple(p) for p in points[corners, :2].tolist()]} (interpolation = "faceVarying")
    rel material:binding = </m/mat>
    def Material "mat" {{
        token outputs:surface.connect = </m/mat/s.outputs:surface>
        def Shader "s" {{
            uniform token info:id = "UsdPreviewSurface"
            color3f inputs:diffuseColor.connect = </m/mat/t.outputs:rgb>
            token outputs:surface
        }}
        def Shader "t" {{ uniform token info:id = "UsdUVTexture"; asset inputs:file = @./texture.png@; float3 outputs:rgb; }}
    }}
}}""",
        subdivision=level,
    )
    (mesh,) = found.meshes()
    assert np.abs(mesh["TEXCOORD_0"] - mesh["POSITION"][:, :2]).max() < 2e-6


def triangles(n: int) -> tuple[np.ndarray, list]:
    """A grid whose interior vertices have six neighbours."""
    points, quads = grid(n)
    return points, [half for a, b, c, d in quads for half in ([a, b, c], [a, c, d])]


def refined(mesh: Cage, level: int) -> Cage:
    for _ in range(level):
        mesh = loop.step(mesh)
    return mesh


def test_loop_on_a_regular_grid_is_a_box_spline() -> None:
    """The quartic box spline reproduces linear functions, and x² but for a constant: (Σ dx²)/12 over the six neighbours, 1/3."""
    points, faces = triangles(8)
    points[:, 2] = points[:, 0] ** 2
    for level in (1, 3):
        p = loop.limit(refined(cage(points, faces), level)).data
        inside = ((p[:, :2] > 2) & (p[:, :2] < 5)).all(axis=1)
        assert inside.sum() >= 9 and np.allclose(p[inside, 2], p[inside, 0] ** 2 + 1 / 3, atol=1e-12)


@pytest.mark.parametrize("n", [3, 4, 5, 7])
def test_loop_limits_do_not_depend_on_the_level(n: int) -> None:
    """(1 − n χ) v + χ Σ over the n neighbours, with χ = 1/(n + 3/(8 β)) and Loop's β, on the control mesh."""
    turn = 2 * np.pi * np.arange(n) / n
    points = np.concatenate([[[0, 0, 1.0]], np.stack([np.cos(turn), np.sin(turn), 0.3 * np.cos(3 * turn)], axis=1), [[0.2, 0, -1]]])
    k = np.arange(n) + 1
    after = np.roll(k, -1)
    faces = [[0, i, j] for i, j in zip(k, after, strict=True)] + [[n + 1, j, i] for i, j in zip(k, after, strict=True)]
    beta = (5 / 8 - (3 / 8 + np.cos(2 * np.pi / n) / 4) ** 2) / n
    chi = 1 / (n + 3 / (8 * beta))
    expected = (1 - n * chi) * points[0] + chi * points[1 : n + 1].sum(axis=0)
    for level in range(4):
        fine = refined(cage(points, faces), level)
        assert len(fine.counts) == 2 * n * 4**level and np.allclose(loop.limit(fine).data[0], expected, atol=1e-12)
        if level:
            normals, which = smooth_normals(fine, fine.data)
            assert which is fine.indices and np.allclose(np.linalg.norm(normals, axis=1), 1) and normals[0, 2] > 0.5


def test_loop_boundaries_and_creases_are_cubic_b_splines() -> None:
    points, faces = triangles(4)
    points[:4, 2] = [0, 1, 3, 0]
    fine = loop.limit(refined(cage(points, faces), 2)).data
    assert np.allclose(fine[1], (points[0] + 4 * points[1] + points[2]) / 6)
    crease = [(5, 6), (6, 7), (4, 5)]
    sharp = loop.limit(refined(cage(points, faces, crease, [10.0] * 3), 2)).data
    assert np.allclose(sharp[5], (points[4] + 4 * points[5] + points[6]) / 6)
    smooth, hard = (loop.step(cage(points, faces, crease, [s] * 3)).data for s in (0.0, 10.0))
    assert np.allclose(loop.step(cage(points, faces, crease, [0.5] * 3)).data, 0.5 * (smooth + hard))


def test_loop_edges_and_normals() -> None:
    """The edges that a level hands on are the ones that a search finds; normals break at the crease, the line y = 1."""
    points, faces = triangles(4)
    fine = refined(cage(points, faces, [(4, 5), (5, 6), (6, 7)], [10.0] * 3), 2)
    known = fine.edges
    ends = np.sort(np.stack([fine.indices, fine.indices[following(fine.counts)]], axis=1), axis=1)
    assert np.array_equal(np.sort(known.ends[known.of_corner], axis=1), ends)
    assert len(np.unique(ends, axis=0)) == len(known.ends) and np.array_equal(np.bincount(known.of_corner), known.faces)
    _, which = smooth_normals(fine, fine.data)
    at: dict[int, set[int]] = {}
    for point, n in zip(fine.indices, which, strict=True):
        at.setdefault(int(point), set()).add(int(n))
    on_crease = np.abs(fine.data[:, 1] - 1) < 1e-9
    assert on_crease.sum() == 13 and all(len(sectors) == (2 if on_crease[i] else 1) for i, sectors in at.items())


def test_loop_of_stages(convert_text) -> None:
    """Triangles are refined without any loss; other faces make it Catmull and Clark's, which is said."""
    points, faces = triangles(4)
    text = f"""def Mesh "m" {{
    int[] faceVertexCounts = {[3] * len(faces)}
    int[] faceVertexIndices = {np.concatenate(faces).tolist()}
    point3f[] points = {[tuple(p) for p in points.tolist()]}
    uniform token subdivisionScheme = "loop"
    color3f[] primvars:displayColor = {[(0.5, i / len(points), 0) for i in range(len(points))]} (interpolation = "varying")
}}"""
    found = convert_text(text, subdivision=2)
    (mesh,) = found.meshes()
    assert len(mesh["triangles"]) == len(faces) * 16 and found.losses("/m") == []
    assert (area_vectors(mesh)[:, 2] > 0).all() and mesh["NORMAL"][:, 2].min() > 0.99
    # Varying values are linear within the faces: at a corner of one face, which stays where it is, its own value.
    corner = np.abs(mesh["POSITION"][:, :2] - [3, 0]).max(axis=1) < 1e-6
    assert corner.any() and np.allclose(mesh["COLOR_0"][corner, 1], 3 / 16)
    mixed = convert_text(MESH % 'uniform token subdivisionScheme = "loop"')
    (loss,) = [x for x in mixed.report.losses if x.path == "/m"]
    assert (loss.kind, loss.what) == ("approximated", "subdivisionScheme") and "triangles" in loss.reason
