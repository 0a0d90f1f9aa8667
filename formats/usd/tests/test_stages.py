"""All stages of the test data: places, looks, lights and cameras of the scene file are those that usd-core's own classes compute."""

from __future__ import annotations

import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import DATA, Converted, convert_file, moved, sphere_box
from expected_lamps import found_lamps, lamp_of
from expected_looks import Look, Missing, Reader, Unknown, differences, found_look
from expected_stage import Expected, Part, start_of
from pxr import Usd, UsdGeom, UsdShade, UsdVol
from renders import program_or_none, read_exr, run

STAGES = sorted(p for p in DATA.rglob("*.usd*") if p.suffix in (".usd", ".usda", ".usdc", ".usdz"))


def name(path: Path) -> str:
    return path.relative_to(DATA).as_posix()


def assert_same(found: np.ndarray, expected: np.ndarray) -> None:
    """Both sets have the same places, to 1e-6 of their extent (and of 1)."""
    assert (len(found) == 0) == (len(expected) == 0)
    if len(found) == 0:
        return
    tolerance = 1e-6 * max(1.0, np.abs(expected).max())
    # Neighbours along one direction are the candidates.
    direction = np.cos(1.0 + 2.0 * np.arange(expected.shape[1]))
    reach = 1.001 * tolerance * np.abs(direction).sum()
    for a, b in ((found, expected), (expected, found)):
        a, b = np.unique(a, axis=0), np.unique(b, axis=0)
        b = b[np.argsort(b @ direction)]
        first = np.searchsorted(b @ direction, a @ direction - reach)
        last = np.searchsorted(b @ direction, a @ direction + reach)
        near = np.zeros(len(a), dtype=bool)
        for k in range(int((last - first).max())):
            at = np.minimum(first + k, len(b) - 1)
            near |= (first + k < last) & (np.abs(b[at] - a).max(axis=1) <= tolerance)
        assert near.all(), a[~near][0]


@pytest.fixture(scope="module", params=STAGES, ids=name)
def converted(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, Converted]:
    folder = tmp_path_factory.mktemp("stages")
    with pytest.MonkeyPatch.context() as environment:
        # It tells the grids of a file.
        if program := program_or_none():
            environment.setenv("RESOLVENT_PROGRAM", program)
        return request.param, convert_file(request.param, folder / "out.json", keep_going=True, subdivision=0)


def test_geometry_is_where_usd_has_it(converted: tuple[Path, Converted]) -> None:
    source, found = converted
    stage = Usd.Stage.Open(str(source))
    assert_same(found.points(), Expected(stage, found.file.parent).points())


def box(points: np.ndarray) -> np.ndarray:
    return np.concatenate([points.min(axis=0), points.max(axis=0)])


def seen(converted: Converted) -> list[tuple[np.ndarray, Look, dict[str, np.ndarray]]]:
    """Where each shape with a look is, what it looks like, and its mesh if it is one."""
    out = []
    for shape, matrix in converted.copies():
        if "material" not in shape or shape["material"] == "black":
            continue
        m = matrix @ np.array(shape.get("transform", np.eye(4)))
        assert shape["type"] in ("gltf", "sphere")
        mesh = converted.mesh(shape) if shape["type"] == "gltf" else {}
        points = moved(mesh["POSITION"], m) if mesh else sphere_box(m, shape["center"], shape["radius"])
        out.append((box(points), found_look(converted, shape), mesh))
    return out


# usd-core can't open this MaterialX document; by the stage's own comment "the entire ball will be 50% gray".
MATERIALX = {"/World/Ball/BallGeom/BallPenta": 0.5}


def assert_looks(found: Converted, stage: Usd.Stage) -> int:
    """Every part of the stage is in the scene, once, with the look that is bound to it; the number of parts compared."""
    expected, shapes = Expected(stage, found.file.parent), seen(found)
    compared = 0
    for part in expected.parts:
        reader = Reader(part, expected.time)
        where = f"{part.bound.GetPath()}"
        try:
            look = reader.look()
        except Missing as missing:
            # Such a prim is in error, and not in the scene.
            assert any(x.kind == "failed" and x.path.startswith(str(missing)) for x in found.report.losses), where
            continue
        except Unknown as unknown:
            assert any(x.path == str(unknown) and x.kind == "skipped" for x in found.report.losses), where
            look = reader.display()
        if (grey := MATERIALX.get(where)) is not None:
            look = Reader.plain(grey)
        place = box(part.points)
        near = 1e-6 * max(1.0, np.abs(place).max())
        there = [i for i, (b, _, _) in enumerate(shapes) if np.abs(b - place).max() <= near]
        assert there, f"{where} is not in the scene"
        problems = [differences(shapes[i][1], look) + corner_differences(shapes[i][2], part, reader) for i in there]
        best = min(range(len(there)), key=lambda k: len(problems[k]))
        assert not problems[best], f"{where}: {problems[best]}"
        del shapes[there[best]]
        compared += 1
    assert not shapes, f"{len(shapes)} shapes are in the scene and not in the stage"
    return compared


def corner_differences(mesh: dict[str, np.ndarray], part: Part, reader: Reader) -> list[str]:
    """Colours and texture coordinates: the same values at the same corners, told by their positions in the mesh's own space."""
    if not mesh or not (reader.uses_corners or reader.uv):
        return []
    usd = UsdGeom.Mesh(part.prim)
    indices = np.array(usd.GetFaceVertexIndicesAttr().Get(reader.time))[part.corners]
    wanted = [np.array(usd.GetPointsAttr().Get(reader.time), dtype=float)[indices]]
    given = [mesh["POSITION"].astype(float)]
    if reader.uses_corners:
        wanted.append(reader.corner_colors())
        given.append(mesh["COLOR_0"])
    if reader.uv:
        wanted.append(reader.at_corners(reader.uv, 0.0, 2))
        given.append(mesh["TEXCOORD_0"])
    try:
        assert_same(np.concatenate(given, axis=1), np.concatenate(wanted, axis=1))
    except AssertionError as error:
        return [f"values at corners: {error}"]
    return []


def test_looks_are_those_that_are_bound(converted: tuple[Path, Converted]) -> None:
    source, found = converted
    stage = Usd.Stage.Open(str(source))
    assert_looks(found, stage)


def assert_lamps(found: Converted, stage: Usd.Stage) -> int:
    """The scene's lights are the stage's, one for one; their number."""
    expected = Expected(stage, found.file.parent)
    lamps = [lamp for prim, m in expected.lights if (lamp := lamp_of(prim, m, expected.time)) is not None]
    left = found_lamps(found)
    for lamp in lamps:
        problems = [differences(other, lamp) for other in left]
        assert problems, f"{lamp} is not in the scene"
        best = min(range(len(left)), key=lambda k: len(problems[k]))
        assert not problems[best], problems[best]
        del left[best]
    assert not left, f"lights that are not in the stage: {left}"
    return len(lamps)


def test_lights_are_what_usd_says(converted: tuple[Path, Converted]) -> None:
    source, found = converted
    assert_lamps(found, Usd.Stage.Open(str(source)))


def assert_media(found: Converted, stage: Usd.Stage) -> int:
    """Each volume whose density is a file that is there is a medium, placed and coloured as the stage says; their number."""
    expected, media = Expected(stage, found.file.parent), dict(found.scene.get("media", {}))
    compared = 0
    for prim, m in expected.volumes:
        field = stage.GetPrimAtPath(UsdVol.Volume(prim).GetFieldPaths().get("density", "/none"))
        file = field.GetAttribute("filePath").Get(expected.time) if field else None
        if not file or not file.resolvedPath or (field.GetAttribute("fieldName").Get() == "no_such_grid" and program_or_none()):
            assert str(prim.GetPath()) not in media
            continue
        medium = media.pop(str(prim.GetPath()))
        # A field below its volume moves with it; elsewhere it stands in the volume's space by its own transform.
        local = np.array(UsdGeom.Xformable(field).GetLocalTransformation(expected.time)).T
        assert not differences(np.array(medium.get("transform", np.eye(4))), m @ local)
        params, phase = medium["params"], medium["params"].get("phase", {"plugin": "hg", "params": {"g": 0.0}})
        assert (medium["plugin"], phase["plugin"]) == ("vdb", "hg")
        assert found.path(params["file"]).read_bytes() == Path(file.resolvedPath).read_bytes()
        assert params["grid"] == field.GetAttribute("fieldName").Get()
        scale = prim.GetAttribute("primvars:densityScale").Get(expected.time) if prim.HasAttribute("primvars:densityScale") else 1.0
        assert not differences(np.array(params["sigma_t"]), np.repeat(scale, 3))
        material, _ = UsdShade.MaterialBindingAPI(prim).ComputeBoundMaterial(UsdShade.Tokens.full)
        shader = material.ComputeVolumeSource()[0] if material else None
        if shader:
            # CONVENTIONS.md: albedo and mean cosine as the shader has them.
            assert shader.GetShaderId() == "ND_volume", "no stage has another one"
            color, g = (np.array(shader.GetInput(n).Get(expected.time), dtype=float) for n in ("scattering_color", "anisotropy"))
        else:
            color, g = np.repeat(0.99, 3), np.zeros(())
        assert not differences(np.array(params["albedo"]), color)
        assert not differences(phase["params"]["g"], g)
        compared += 1
    assert not media
    return compared


def test_volumes_are_what_usd_says(converted: tuple[Path, Converted]) -> None:
    source, found = converted
    assert_media(found, Usd.Stage.Open(str(source)))


def cameras_of(stage: Usd.Stage) -> list[Usd.Prim]:
    return [p for p in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)) if p.IsA(UsdGeom.Camera)]


def assert_camera(scene: dict[str, Any], camera: UsdGeom.Camera, time: Usd.TimeCode) -> None:
    """The scene's camera is GfCamera's: place, window, lens; and UsdGeom's exposure."""
    gf = camera.GetCamera(time)
    frustum, ours, film = gf.frustum, scene["camera"], scene["film"]
    assert np.allclose(ours["transform"], np.array(frustum.ComputeViewInverse()).T, rtol=0, atol=1e-6)
    # The window on the plane at distance 1 (of parallel rays: itself), widened in one direction to the picture's shape.
    parallel = str(gf.projection).endswith("Orthographic")
    assert ours["type"] == ("orthographic" if parallel else "perspective")
    width = ours["width"] if parallel else 2.0 * math.tan(math.radians(ours["fov_x_deg"]) / 2)
    shape = film["resolution"][0] / film["resolution"][1]
    shift = ours.get("shift", [0, 0])
    window = frustum.window
    middle = 0.5 * (np.array(window.min) + np.array(window.max))
    assert np.allclose(middle, [width * shift[0], width / shape * shift[1]], rtol=0, atol=1e-6)
    size = window.GetSize()
    assert width == pytest.approx(max(size[0], size[1] * shape), rel=1e-6)
    if gf.fStop > 0 and not parallel:
        # Half the diameter, focal length over fStop, which are in tenths of a unit.
        assert ours["lens_radius"] == pytest.approx(0.05 * gf.focalLength / gf.fStop, rel=1e-6)
        assert ours["focus_distance"] == pytest.approx(gf.focusDistance, rel=1e-6)
    else:
        assert "lens_radius" not in ours
    assert ours.get("exposure", 0.0) == pytest.approx(math.log2(camera.ComputeLinearExposureScale(time)), abs=1e-6)


def test_camera_sees_what_usd_says(converted: tuple[Path, Converted], tmp_path: Path) -> None:
    """Every camera of the stage: the first one is the scene's, others if they are asked for."""
    source, found = converted
    stage = Usd.Stage.Open(str(source))
    cameras = cameras_of(stage)
    if not cameras:
        assert "camera" in {x.what for x in found.report.losses}
    for number, prim in enumerate(cameras):
        if number > 0:
            found = convert_file(source, tmp_path / "other.json", keep_going=True, subdivision=0, camera=str(prim.GetPath()))
        assert_camera(found.scene, UsdGeom.Camera(prim), start_of(stage))


def test_the_stages_unit_is_the_scenes(converted: tuple[Path, Converted]) -> None:
    source, found = converted
    expected = UsdGeom.GetStageMetersPerUnit(Usd.Stage.Open(str(source)))
    assert found.scene["units"]["meters_per_unit"] == pytest.approx(expected)


def leaves(node: Any) -> Iterator[tuple[Any, Any]]:
    """(container, key) of all numbers and words of a part of a scene that have a meaning."""
    if node == [0.0, 0.0, 0.0, 1.0]:
        # The last row of a matrix.
        return
    for key in list(node.keys() if isinstance(node, dict) else range(len(node))):
        if isinstance(node[key], (dict, list)):
            yield from leaves(node[key])
        else:
            yield node, key


WRONG = {
    "own/assembly.usda": ("materials", "shapes", "prototypes"),
    "own/lights_all.usda": ("lights", "shapes", "camera"),
    "own/cloud_volume.usda": ("materials", "lights", "media"),
    "openusd/PreviewSurface/testPreviewSurfaceTransform2d.usda": ("materials", "textures"),
    "openusd/PreviewSurface/testPreviewSurfaceTranslucent.usda": ("materials",),
    "openusd/PreviewSurface/testPreviewSurfaceSpecular.usda": ("materials",),
    "openusd/Instancing/instancedCubes.usda": ("materials", "instances", "lights"),
}


@pytest.mark.parametrize("stage_name", WRONG)
def test_any_wrong_value_would_be_found(stage_name: str, tmp_path: Path) -> None:
    """Each value of the scene in turn is changed by 2e-4 or to another word: then one of the tests above fails."""
    source = DATA / stage_name
    stage, found = Usd.Stage.Open(str(source)), convert_file(source, tmp_path / "out.json", keep_going=True, subdivision=0)
    camera = (cameras_of(stage) or [None])[0]

    def fails() -> bool:
        try:
            assert_looks(found, stage)
            assert_lamps(found, stage)
            assert_media(found, stage)
            if camera:
                assert_camera(found.scene, UsdGeom.Camera(camera), start_of(stage))
        except (AssertionError, KeyError, FileNotFoundError):
            return True
        return False

    assert not fails()
    unseen, changed = [], 0
    for part in WRONG[stage_name]:
        for container, key in list(leaves(found.scene[part])):
            value = container[key]
            container[key] = value + "x" if isinstance(value, str) else value + 2e-4 * max(1.0, abs(value))
            changed += 1
            if not fails():
                unseen.append((part, key, value))
            container[key] = value
    assert changed > 3 and not unseen, unseen


def test_every_stage_renders(converted: tuple[Path, Converted]) -> None:
    """What is converted is a scene that the renderer takes; its pictures are judged in test_radiometry.py and test_volumes.py."""
    _, found = converted
    out = found.path("picture.exr")
    done = run("render", found.file, "-o", out, "--resolution", "16x16", "--spp", "1", "--quiet")
    assert done.returncode == 0, done.stderr
    assert np.isfinite(read_exr(out)).all()
