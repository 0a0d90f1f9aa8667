"""Shapes, prototypes and instances."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Sdf, UsdGeom, Vt

from ..report import InputError
from ..scene import Json, Matrix
from . import lights, models
from .looks import Looks
from .stage import Target, around, matrix, place

_SIDES = 128


def write(target: Target) -> None:
    """All shapes of the world, and the copies of prototypes."""
    looks = Looks(target)
    for number, shape in enumerate(target.scene.get("shapes", [])):
        _shape(target, looks, shape, f"/shapes/{number}", np.eye(4), "/World")
    for number, instance in enumerate(target.scene.get("instances", [])):
        name = instance["prototype"]
        outer = matrix(instance.get("transform"))
        matrices = [np.eye(4)]
        if "transforms" in instance:
            table = np.load(target.file(instance["transforms"]))
            matrices = [np.vstack([m[:3], [0.0, 0.0, 0.0, 1.0]]) for m in table]
        if "material" in instance:
            target.report.approximated(f"/instances/{number}", "material", "copies in the stage share their prototype's", "that one is used")
        prototype = _prototype(target, looks, name)
        for m in matrices:
            copy = UsdGeom.Xform.Define(target.stage, target.path(f"{name}_copy"))
            place(copy, outer @ m)
            copy.GetPrim().GetReferences().AddInternalReference(prototype)
            copy.GetPrim().SetInstanceable(True)


def _prototype(target: Target, looks: Looks, name: str) -> Sdf.Path:
    """The prim that copies refer to; a class, so that it is not seen itself."""
    known: dict[str, Sdf.Path] = target.__dict__.setdefault("_prototypes", {})
    if name not in known:
        path = target.path(name, "")
        target.stage.CreateClassPrim(path)
        known[name] = path
        for number, shape in enumerate(target.scene.get("prototypes", {}).get(name, [])):
            _shape(target, looks, shape, f"/prototypes/{name}/{number}", np.eye(4), str(path))
    return known[name]


def _shape(target: Target, looks: Looks, shape: Json, where: str, to_parent: Matrix, parent: str) -> None:
    kind = shape["type"]
    name = f"{kind}_{where.rsplit('/', 1)[-1]}"
    materials = target.scene.get("materials", {})
    for key in ("interior", "priority"):
        if key in shape:
            target.report.skipped(where, key, "USD has no surfaces that are filled", "nothing is inside")
    world = parent == "/World"
    if world and "emission" in shape and lights.material_free(shape, materials):
        if kind == "rectangle":
            texture = target.scene.get("textures", {}).get(shape.get("emission_texture"))
            lights.rectangle(target, name, shape, shape["emission"], texture)
            return
        if kind in ("sphere", "disk", "cylinder") and lights.emitter(target, name, shape, np.eye(4)):
            return
    if "shaping" in shape:
        target.report.skipped(where, "shaping", "only lights without a material of their own are shaped in stages", "it shines evenly")
    if shape.get("two_sided"):
        target.report.approximated(where, "two_sided", "emissive materials of stages shine outwards", "from one side only")
    path = target.path(name, parent)
    if kind == "sphere":
        sphere = UsdGeom.Sphere.Define(target.stage, path)
        sphere.CreateRadiusAttr(float(shape["radius"]))
        local: Matrix = np.eye(4)
        local[:3, 3] = shape["center"]
        place(sphere, local)
        looks.bind(sphere, shape)
        return
    try:
        found = list(_triangles(target, shape))
    except (InputError, OSError) as error:
        target.report.skipped(where, kind, str(error), "it is not in the stage")
        return
    if kind in ("disk", "cylinder"):
        target.report.approximated(where, kind, "USD has none that is open or flat", f"a mesh of {_SIDES} sides")
    for i, m in enumerate(found):
        mesh = UsdGeom.Mesh.Define(target.stage, path if i == 0 else target.path(name, parent))
        place(mesh, matrix(shape.get("transform")))
        _fill(mesh, m)
        looks.bind(mesh, shape)


def _fill(mesh: UsdGeom.Mesh, m: models.Mesh) -> None:
    mesh.CreateSubdivisionSchemeAttr("none")
    mesh.CreatePointsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(m.positions, dtype=np.float32)))
    mesh.CreateFaceVertexCountsAttr(Vt.IntArray.FromNumpy(np.full(len(m.indices), 3, dtype=np.int32)))
    mesh.CreateFaceVertexIndicesAttr(Vt.IntArray.FromNumpy(np.ascontiguousarray(m.indices, dtype=np.int32).reshape(-1)))
    if m.normals is not None:
        mesh.CreateNormalsAttr(Vt.Vec3fArray.FromNumpy(np.ascontiguousarray(m.normals, dtype=np.float32)))
        mesh.SetNormalsInterpolation(UsdGeom.Tokens.vertex)
    if m.uvs is not None:
        st = UsdGeom.PrimvarsAPI(mesh).CreatePrimvar("st", Sdf.ValueTypeNames.TexCoord2fArray, UsdGeom.Tokens.vertex)
        st.Set(Vt.Vec2fArray.FromNumpy(np.ascontiguousarray(m.uvs, dtype=np.float32)))


def _triangles(target: Target, shape: Json) -> Any:
    kind = shape["type"]
    if kind == "gltf":
        return models.read(target.file(shape["file"]))
    if kind == "mesh":
        normals, uvs = shape.get("normals"), shape.get("uvs")
        extra = [np.asarray(v, dtype=float) if v else None for v in (normals, uvs)]
        return [models.Mesh(np.asarray(shape["positions"]), np.asarray(shape["indices"]), *extra)]
    if kind == "rectangle":
        corner, u, v = (np.asarray(shape[k], dtype=float) for k in ("corner", "edge_u", "edge_v"))
        points = np.stack([corner, corner + u, corner + u + v, corner + v])
        uvs = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])
        return [models.Mesh(points, np.array([[0, 1, 2], [0, 2, 3]]), None, uvs)]
    phi = 2.0 * np.pi * np.arange(_SIDES) / _SIDES
    k = np.arange(_SIDES)
    after = (k + 1) % _SIDES
    if kind == "disk":
        turn = around(shape["normal"])
        rim = float(shape["radius"]) * (np.outer(np.cos(phi), turn[:3, 0]) + np.outer(np.sin(phi), turn[:3, 1]))
        points = np.concatenate([rim, np.zeros((1, 3))]) + np.asarray(shape["center"], dtype=float)
        return [models.Mesh(points, np.stack([np.full(_SIDES, _SIDES), k, after], axis=1), None, None)]
    if kind == "cylinder":
        axis, base = np.asarray(shape["axis"], dtype=float), np.asarray(shape["base"], dtype=float)
        turn = around(axis)
        normals = np.outer(np.cos(phi), turn[:3, 0]) + np.outer(np.sin(phi), turn[:3, 1])
        rim = base + float(shape["radius"]) * normals
        sides = [np.stack([k, after, after + _SIDES], axis=1), np.stack([k, after + _SIDES, k + _SIDES], axis=1)]
        return [models.Mesh(np.concatenate([rim, rim + axis]), np.concatenate(sides), np.concatenate([normals, normals]), None)]
    raise InputError(kind, "shapes of this type are not written to stages")
