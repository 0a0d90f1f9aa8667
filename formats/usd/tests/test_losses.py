"""Nothing is dropped silently: for every schema that usd-core knows, every attribute either changes the scene or is reported."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import PIXEL
from pxr import Gf, Sdf, Tf, Usd, Vt

from resolvent_usd.context import Options
from resolvent_usd.convert import convert
from resolvent_usd.report import Report

QUAD = {
    "points": Vt.Vec3fArray([(0, 0, 0), (1, 0, 0), (1, 1, 0.5), (0, 1, 0)]),
    "faceVertexCounts": Vt.IntArray([4]),
    "faceVertexIndices": Vt.IntArray([0, 1, 2, 3]),
}
# What a prim of the type needs to be of any effect.
BASE: dict[str, dict[str, Any]] = {
    "Mesh": QUAD,
    "Points": {"points": QUAD["points"], "widths": Vt.FloatArray([1, 1, 1, 1])},
    "BasisCurves": {
        "points": QUAD["points"], "curveVertexCounts": Vt.IntArray([4]), "widths": Vt.FloatArray([0.1] * 4),
    },
    "PointInstancer": {"positions": Vt.Vec3fArray([(0, 0, 0), (1, 0, 0)]), "protoIndices": Vt.IntArray([0, 0])},
    "Camera": {"fStop": 2.8, "focusDistance": 5.0},
    "RectLight": {"inputs:width": 2.0},
}  # fmt: skip
# Attributes without a meaning for pictures of an instant, by what they are for.
NEUTRAL = {
    "extent", "extentsHint",  # bounds, as hints
    "doubleSided", "ids", "triangleSubdivisionRule",  # hints of rasterisers; names; rules for triangles
    "stereoRole", "proxyPrim", "dataType", "productName", "productType",
    "shutter:open", "shutter:close",  # of motion blur: reported if they differ
    "disableMotionBlur", "instantaneousShutter", "materialBindingPurposes",
    "treatAsLine", "treatAsPoint", "guideRadius",  # hints of rasterisers and viewports
    "light:materialSyncMode",  # of the material that a mesh light has
    # Of effect with others only, and tested with them: texture coordinates, a picture, targets of links.
    "faceVaryingLinearInterpolation", "poleAxis", "inputs:texture:format",
}  # fmt: skip
NEUTRAL_FOR = {
    # Tubes and spheres have no side that could be the other one.
    ("BasisCurves", "orientation"), ("Points", "orientation"), ("Sphere", "orientation"),
    ("OpenVDBAsset", "visibility"), ("Field3DAsset", "visibility"),  # of their volumes it counts
    ("DomeLight", "inputs:normalize"), ("DomeLight_1", "inputs:normalize"),  # by the specification
    # Of effect with enableColorTemperature, a focus and an IES file.
    ("Mesh", "inputs:colorTemperature"), ("SphereLight", "inputs:shaping:focusTint"),
    ("SphereLight", "inputs:shaping:ies:angleScale"), ("SphereLight", "inputs:shaping:ies:normalize"),
}  # fmt: skip

# Prims of no effect by themselves, of which a note says so; in their places they are tested in test_volumes.py and test_materials.py.
ALONE = {
    "OpenVDBAsset": "a field that no volume in the picture has", "Field3DAsset": "a field that no volume in the picture has",
    "PortalLight": "portals are of no use to this renderer", "Shader": "nothing that is drawn has this material",
}  # fmt: skip


def kinds(*wanted: str) -> list[str]:
    out = []
    for schema in Tf.Type(Usd.SchemaBase).GetAllDerivedTypes():
        info = Usd.SchemaRegistry.FindSchemaInfo(schema)
        if info is not None and str(info.kind).split(".")[-1] in wanted:
            out.append(str(info.identifier))
    return sorted(out)


CONCRETE = kinds("ConcreteTyped")
APIS = kinds("SingleApplyAPI", "MultipleApplyAPI")


def base_stage(kind: str, folder: Path) -> tuple[Usd.Stage, Usd.Prim]:
    stage = Usd.Stage.CreateNew(str(folder / f"{kind}.usda")) if not (folder / f"{kind}.usda").exists() else None
    assert stage is not None
    prim = stage.DefinePrim("/thing", kind)
    for name, value in BASE.get(kind, {}).items():
        prim.GetAttribute(name).Set(value)
    if attribute := prim.GetAttribute("inputs:enableColorTemperature"):
        attribute.Set(True)
    if kind in ("Xform", "Scope", "SkelRoot"):
        stage.DefinePrim("/thing/child", "Sphere")
    if kind.startswith("Render"):
        _render_settings(stage, kind)
    if kind == "PointInstancer":
        stage.DefinePrim("/thing/proto", "Sphere")
        prim.GetRelationship("prototypes").SetTargets(["/thing/proto"])
    return stage, prim


def _render_settings(stage: Usd.Stage, kind: str) -> None:
    """Puts the prim where it belongs among settings, products and variables, with a camera."""
    camera = stage.DefinePrim("/camera", "Camera")
    for name, value in BASE["Camera"].items():
        camera.GetAttribute(name).Set(value)
    names = {k: "/thing" if k == kind else f"/{k}" for k in ("RenderSettings", "RenderProduct", "RenderVar")}
    for k, path in names.items():
        stage.DefinePrim(path, k)
    stage.GetPrimAtPath(names["RenderSettings"]).GetRelationship("products").SetTargets([names["RenderProduct"]])
    stage.GetPrimAtPath(names["RenderProduct"]).GetRelationship("orderedVars").SetTargets([names["RenderVar"]])
    stage.GetPrimAtPath(names["RenderVar"]).GetAttribute("sourceName").Set("albedo")


def scene_of(stage: Usd.Stage, folder: Path) -> tuple[str, Report]:
    report = Report()
    convert(stage, folder / "out.json", Options(keep_going=True), report)
    scene = json.loads((folder / "out.json").read_text())
    tables = [(folder / i["transforms"]).read_bytes().hex() for i in scene.get("instances", []) if "transforms" in i]
    return json.dumps([scene, tables], sort_keys=True), report


def other_value(attribute: Usd.Attribute) -> Any:
    """A value of the attribute's type that is unlike its present one, and likely legal."""
    value, kind = attribute.Get(), attribute.GetTypeName()
    scalar = str(kind.scalarType) if kind.isArray else str(kind)
    if attribute.GetName() == "purpose":
        return "guide"
    if tokens := attribute.GetMetadata("allowedTokens"):
        others = [t for t in tokens if t != value]
        return others[0] if others else None
    match value:
        case bool():
            return not value
        case int():
            return value + 1
        case float():
            return value * 0.5 + 0.3
        case str() if scalar in ("token", "string"):
            return value + "x"
    if kind.isArray:
        length = len(value) if value is not None and len(value) else 4
        items = {"float": 0.3, "double": 0.3, "half": 0.3, "int": 1, "int64": 1}.get(scalar)
        if items is not None:
            array = np.full(length, items)
            present = np.asarray(value) if value is not None and len(value) else None
            if present is not None and np.array_equal(present, array):
                array = array * 0.5
            return kind.type.pythonClass(array.tolist())
    if scalar in ("asset",):
        return Sdf.AssetPath("./texture.png")
    python = kind.type.pythonClass
    for candidate in ((0.25, 0.5, 0.75), (0.25, 0.5), (0.25, 0.5, 0.75, 1.0), 0.25, 1, "x", True):
        try:
            if kind.isArray:
                item = kind.scalarType.type.pythonClass
                return python([item(*candidate) if isinstance(candidate, tuple) else item(candidate)] * 4)
            return python(*candidate) if isinstance(candidate, tuple) else python(candidate)
        except Exception:  # noqa: BLE001  Boost's errors have no common base.
            continue
    return Gf.Matrix4d(2.0) if scalar == "matrix4d" else None


def whole_prim_reported(report: Report, kind: str) -> bool:
    return any(x.path == "/thing" and x.what in ("", kind) and x.kind in ("skipped", "failed") for x in report.losses)


def silent_attributes(stage: Usd.Stage, prim: Usd.Prim, names: list[str], folder: Path) -> list[str]:
    """Attributes whose change neither shows in the scene nor is reported."""
    before, _ = scene_of(stage, folder)
    silent = []
    for name in names:
        attribute = prim.GetAttribute(name)
        neutral = name in NEUTRAL or (prim.GetTypeName(), name) in NEUTRAL_FOR
        if neutral or name.startswith(("collection:", "ui:")) or not attribute:
            continue
        value, authored = attribute.Get(), attribute.HasAuthoredValue()
        other = other_value(attribute)
        if other is None:
            continue
        try:
            attribute.Set(other)
        except Tf.ErrorException:
            continue
        after, report = scene_of(stage, folder)
        what = name.removesuffix(":indices")
        alone = ALONE.get(prim.GetTypeName())
        mentioned = any(n["path"] == "/thing" and (what in n["note"] or n["note"] == alone) for n in report.notes)
        mentioned |= any(what in f"{x.path} {x.what}" for x in report.losses)
        if after == before and not mentioned and not whole_prim_reported(report, prim.GetTypeName()):
            silent.append(f"{name} = {other}"[:100])
        if authored:
            attribute.Set(value)
        else:
            attribute.Clear()
    return silent


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    (tmp_path / "texture.png").write_bytes(PIXEL)
    return tmp_path


@pytest.mark.parametrize("kind", CONCRETE)
def test_every_attribute_of_every_type(kind: str, folder: Path) -> None:
    stage, prim = base_stage(kind, folder)
    _, report = scene_of(stage, folder)
    if whole_prim_reported(report, kind):
        return
    silent = silent_attributes(stage, prim, [a.GetName() for a in prim.GetAttributes()], folder)
    assert not silent, "\n".join(silent)


@pytest.mark.parametrize("api", APIS)
@pytest.mark.parametrize("kind", ["Mesh", "SphereLight"])
def test_every_applied_schema(api: str, kind: str, folder: Path) -> None:
    stage, prim = base_stage(kind, folder)
    plain = {a.GetName() for a in prim.GetAttributes()}
    multiple = Usd.SchemaRegistry.IsMultipleApplyAPISchema(api)
    prim.AddAppliedSchema(f"{api}:one" if multiple else api)
    _, report = scene_of(stage, folder)
    if any(x.path == "/thing" and x.what.startswith(api) for x in report.losses):
        return
    added = [a.GetName() for a in prim.GetAttributes() if a.GetName() not in plain]
    silent = silent_attributes(stage, prim, added, folder)
    assert not silent, "\n".join(silent)


@pytest.mark.parametrize("link", ["lightLink", "shadowLink"])
def test_links_of_lights(link: str, folder: Path) -> None:
    stage, prim = base_stage("SphereLight", folder)
    stage.DefinePrim("/ball", "Sphere")
    prim.GetRelationship(f"collection:{link}:excludes").SetTargets(["/ball"])
    _, report = scene_of(stage, folder)
    assert any(link in x.what for x in report.losses)


def test_custom_attributes_unknown_types_and_relationships(folder: Path) -> None:
    stage, prim = base_stage("Mesh", folder)
    prim.CreateAttribute("myOwn", Sdf.ValueTypeNames.Float, custom=True).Set(1.0)
    prim.CreateRelationship("myTarget").SetTargets(["/thing"])
    prim.CreateAttribute("userProperties:fine", Sdf.ValueTypeNames.Float, custom=True).Set(1.0)
    stage.DefinePrim("/strange", "NoSuchType")
    _, report = scene_of(stage, folder)
    assert {(x.path, x.what) for x in report.losses if x.what != "camera"} == {
        ("/thing", "myOwn"), ("/thing", "myTarget"), ("/strange", "NoSuchType"),
    }  # fmt: skip


def test_summary_and_json(folder: Path) -> None:
    report = Report()
    for k in range(30):
        report.skipped(f"/a{k}", "radius", "why", "what")
    report.approximated("/b", "", "why", "what")
    report.skipped("/a0", "radius", "why", "what")
    lines = list(report.summary())
    assert lines[0] == "skipped: /a0 and 29 more radius: why; what" and len(lines) == 2
    assert len(report.to_json()["losses"]) == 31

