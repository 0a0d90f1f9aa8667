"""What usd-core says is in a stage, and where: by its caches and its point instancer, not by the converter's."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from conftest import convert_stage, moved, sphere_box
from pxr import Gf, Usd, UsdGeom, UsdLux, UsdShade

SIZES = ("radius", "size", "height", "axis", "width", "length")


@dataclass(frozen=True)
class Part:
    """What has one material: a gprim, or some faces of a mesh."""

    prim: Usd.Prim
    subset: Usd.Prim | None
    points: np.ndarray
    """World positions of its corners."""
    corners: np.ndarray
    """Of meshes: the corners (positions in faceVertexIndices) of the faces that are shown."""

    @property
    def bound(self) -> Usd.Prim:
        """The prim whose material it has."""
        return self.subset or self.prim


def start_of(stage: Usd.Stage) -> Usd.TimeCode:
    """The time of a conversion without --frame."""
    return Usd.TimeCode(stage.GetStartTimeCode()) if stage.HasAuthoredTimeCodeRange() else Usd.TimeCode.EarliestTime()


class Expected:
    """All that is to be seen, copies apart."""

    def __init__(self, stage: Usd.Stage, folder: Path) -> None:
        self.stage, self.folder = stage, folder
        self.time = start_of(stage)
        self.cache = UsdGeom.XformCache(self.time)
        self.parts: list[Part] = []
        self.lights: list[tuple[Usd.Prim, np.ndarray]] = []
        self.volumes: list[tuple[Usd.Prim, np.ndarray]] = []
        self.local: dict[str, np.ndarray] = {}
        self.below(stage.GetPseudoRoot(), np.eye(4), None)

    def points(self) -> np.ndarray:
        return np.concatenate([np.empty((0, 3)), *(part.points for part in self.parts)])

    def below(self, root: Usd.Prim, outer: np.ndarray, origin: Usd.Prim | None) -> None:
        prims = iter(Usd.PrimRange(root, Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)))
        for prim in prims:
            imageable = UsdGeom.Imageable(prim)
            if not imageable:
                continue
            seen = imageable.GetVisibilityAttr().Get(self.time) != "invisible"
            if not seen or imageable.ComputePurpose() not in ("default", "render"):
                prims.PruneChildren()
                continue
            to_outer = self.cache.GetLocalToWorldTransform(prim)
            if origin is not None:
                # The prototype's own transform is among the instancer's.
                to_outer = to_outer * self.cache.GetLocalToWorldTransform(origin).GetInverse()
            matrix = outer @ affine(to_outer)
            if prim.IsA(UsdGeom.PointInstancer):
                self.instancer(UsdGeom.PointInstancer(prim), matrix)
                prims.PruneChildren()
            elif prim.IsA(UsdGeom.Gprim) and abs(np.linalg.det(matrix[:3, :3])) > 0:
                self.gprim(prim, matrix)
            elif prim.HasAPI(UsdLux.LightAPI):
                self.lights.append((prim, matrix))

    def instancer(self, instancer: UsdGeom.PointInstancer, matrix: np.ndarray) -> None:
        targets = instancer.GetPrototypesRel().GetForwardedTargets()
        indices = instancer.GetProtoIndicesAttr().Get(self.time)
        found = instancer.ComputeInstanceTransformsAtTime(
            self.time, self.time, instancer.IncludeProtoXform, instancer.IgnoreMask
        )
        mask = list(instancer.ComputeMaskAtTime(self.time)) or [True] * len(indices)
        for i, m, shown in zip(indices, found, mask, strict=True):
            if shown:
                prototype = self.stage.GetPrimAtPath(targets[i])
                self.below(prototype, matrix @ affine(m), prototype)

    def gprim(self, prim: Usd.Prim, matrix: np.ndarray) -> None:
        match prim.GetTypeName():
            case "Mesh":
                self.mesh(prim, matrix)
            case "Sphere":
                self.part(prim, sphere_box(matrix, [0, 0, 0], UsdGeom.Sphere(prim).GetRadiusAttr().Get(self.time)))
            case "Cube" | "Cylinder" | "Cone" | "Capsule" | "Plane":
                self.part(prim, moved(self.alone(prim), matrix))
            case "Volume":
                self.volumes.append((prim, matrix))

    def part(self, prim: Usd.Prim, points: np.ndarray, subset: Usd.Prim | None = None, corners: Any = ()) -> None:
        self.parts.append(Part(prim, subset, points, np.asarray(corners, dtype=int)))

    def mesh(self, prim: Usd.Prim, matrix: np.ndarray) -> None:
        """The faces of each subset with a material, and the rest."""
        mesh = UsdGeom.Mesh(prim)
        points = np.array(mesh.GetPointsAttr().Get(self.time) or [])
        if points.shape[1:] != (3,):
            # No points, or something of another type than the schema's.
            return
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get(self.time) or [], dtype=int)
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(self.time) or [], dtype=int)
        owner = np.zeros(len(counts), dtype=int)
        subsets = [None, *(s.GetPrim() for s in UsdShade.MaterialBindingAPI(prim).GetMaterialBindSubsets())]
        for number, subset in enumerate(subsets[1:], 1):
            owner[list(UsdGeom.Subset(subset).GetIndicesAttr().Get(self.time) or [])] = number
        owner[list(mesh.GetHoleIndicesAttr().Get(self.time) or [])] = -1
        for number, subset in enumerate(subsets):
            corners = np.flatnonzero(np.repeat(owner == number, counts))
            if len(corners):
                self.part(prim, moved(points[np.unique(indices[corners])], matrix), subset, corners)

    def alone(self, prim: Usd.Prim) -> np.ndarray:
        """Local corners of an implicit shape: its conversion at the origin. (That is tested against extents elsewhere.)"""
        values = {a.GetName(): a.Get(self.time) for a in prim.GetAttributes() if a.GetName() in SIZES}
        key = str((prim.GetTypeName(), values))
        if key not in self.local:
            stage = Usd.Stage.CreateInMemory()
            copy = stage.DefinePrim("/shape", prim.GetTypeName())
            for attribute, value in values.items():
                copy.GetAttribute(attribute).Set(value)
            self.local[key] = convert_stage(stage, self.folder / "alone.json").points()
        return self.local[key]


def affine(m: Gf.Matrix4d) -> np.ndarray:
    out = np.array(m).T
    out[3] = [0, 0, 0, 1]
    return out
