"""UsdGeom Mesh: polygons and subdivision surfaces with their primvars, holes and subsets."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from pxr import UsdGeom

from ..claim import Claim
from ..context import Context, Look
from ..registry import converts
from ..report import InputError
from . import primvars
from .glb import write
from .looks import look_of
from .primvars import Primvar, Topology
from .refine import Surface, refine

Ints = NDArray[np.int64]


@converts("GeomSubset")
def subset(ctx: Context, claim: Claim) -> None:
    """Subsets belong to the mesh above; of other shapes they have no effect."""
    if claim.prim.GetParent().GetTypeName() == "Mesh":
        claim.release()
        return
    claim.take("familyName", "elementType", "indices")
    claim.take_prefix("material:binding")
    claim.take_schema("MaterialBindingAPI")
    claim.skipped("", "only meshes have subsets", "their materials have no effect")


@converts("Mesh")
def mesh(ctx: Context, claim: Claim) -> None:
    """Converts a mesh: one glTF shape for each material."""
    no_motion(claim)
    claim.take("doubleSided")  # A hint: surfaces are seen from both sides.
    claim.take_prefix("subsetFamily:")  # Says how subsets are meant to be disjoint; those that are not are reported.
    topology = _topology(claim)
    points = claim.array("points", np.float32, 3)
    if points is None or not len(topology.counts):
        claim.get("points")
        ctx.report.note(claim.path, "a mesh without faces")
        _parts(ctx, claim, topology)
        return
    surface = _surface(ctx, claim, topology, points)
    for look, faces in _parts(ctx, claim, topology):
        emit(ctx, claim, surface, look, faces)


def no_motion(claim: Claim) -> None:
    """Pictures are of an instant."""
    for name in ("velocities", "accelerations", "motion:blurScale", "angularVelocities"):
        claim.no_effect(name, "motion blur is not rendered", "the picture shows one instant")


def _topology(claim: Claim) -> Topology:
    counts = claim.array("faceVertexCounts", np.int64)
    indices = claim.array("faceVertexIndices", np.int64)
    points = claim.array("points", np.float32, 3)
    counts = np.empty(0, dtype=np.int64) if counts is None else counts
    indices = np.empty(0, dtype=np.int64) if indices is None else indices
    n = 0 if points is None else len(points)
    if len(counts) and counts.min() < 3:
        face = int(np.argmax(counts < 3))
        raise InputError(f"{claim.path}.faceVertexCounts", f"face {face} has {counts[face]} vertices: at least 3 make a face")
    if counts.sum() != len(indices):
        raise InputError(
            f"{claim.path}.faceVertexIndices",
            f"has {len(indices)} elements where faceVertexCounts adds up to {counts.sum()}",
        )
    if len(indices) and (indices.min() < 0 or indices.max() >= n):
        bad = indices.min() if indices.min() < 0 else indices.max()
        raise InputError(f"{claim.path}.faceVertexIndices", f"names point {bad}; there are {n}")
    return Topology(n, counts, indices)


def _surface(ctx: Context, claim: Claim, topology: Topology, points: NDArray[Any]) -> Surface:
    """The polygons that are shown, subdivided if the mesh is a subdivision surface."""
    scheme = str(claim.get("subdivisionScheme"))
    flipped = claim.get("orientation") == UsdGeom.Tokens.leftHanded
    normals = _normals(claim, topology, scheme)
    if scheme not in ("none", "catmullClark", "bilinear", "loop"):
        raise InputError(f"{claim.path}.subdivisionScheme", f"is '{scheme}', which is no scheme")
    if scheme == "loop" and topology.counts.max() > 3:
        claim.approximated("subdivisionScheme", "Loop subdivision is for triangles, and the mesh has other faces", "it is that of Catmull and Clark")
        scheme = "catmullClark"
    holes = claim.array("holeIndices", np.int64)
    if holes is not None and len(holes) and (holes.min() < 0 or holes.max() >= len(topology.counts)):
        raise InputError(f"{claim.path}.holeIndices", f"names a face that is not there; there are {len(topology.counts)}")
    return refine(ctx, claim, topology, points, scheme, flipped, normals, holes)


def _normals(claim: Claim, topology: Topology, scheme: str) -> Primvar | None:
    """Authored normals of polygonal meshes; subdivision surfaces have their own."""
    found = primvars.read(claim, "normals")
    if found is None and claim.authored("normals"):
        values = claim.array("normals", float, 3)
        interpolation = str(UsdGeom.PointBased(claim.prim).GetNormalsInterpolation())
        if values is not None and len(values):
            found = Primvar("normals", values, interpolation)
    claim.take("normals")
    if found is None:
        return None
    if scheme != "none":
        claim.ctx.report.note(claim.path, "normals of a subdivision surface are its own; those authored are not used")
        return None
    return primvars.checked(claim, found, topology)


def _parts(ctx: Context, claim: Claim, topology: Topology) -> list[tuple[Look, Ints | None]]:
    """Looks and the faces that have them (None: all); the faces of no subset have the mesh's own."""
    owner = np.full(len(topology.counts), -1, dtype=np.int64)
    looks: list[Look] = []
    bound = False
    for subset in UsdGeom.Subset.GetAllGeomSubsets(UsdGeom.Imageable(claim.prim)):
        part = ctx.claim(subset.GetPrim(), claim.matrix, claim.group)
        part.take("familyName", "elementType")
        faces = part.array("indices", np.int64)
        names = [n for n in part.prim.GetAuthoredPropertyNames() if n.startswith("material:binding")]
        if not names:
            continue
        if part.get("elementType") != "face":
            part.skipped("elementType", "only subsets of faces can have materials", "the mesh's material is used there")
            part.take_prefix("material:binding")
            continue
        faces = np.empty(0, dtype=np.int64) if faces is None else faces
        if len(faces) and (faces.min() < 0 or faces.max() >= len(owner)):
            raise InputError(f"{part.path}.indices", f"names a face that is not there; there are {len(owner)}")
        if (owner[faces] >= 0).any():
            part.approximated("indices", "faces belong to several subsets", "the first subset's material is used there")
            faces = faces[owner[faces] < 0]
        owner[faces] = len(looks)
        looks.append(look_of(ctx, claim, part, corners=True))
        bound = True
    if not bound:
        return [(look_of(ctx, claim, corners=True), None)]
    parts: list[tuple[Look, Ints | None]] = []
    rest = np.flatnonzero(owner < 0)
    if len(rest):
        parts.append((look_of(ctx, claim, corners=True), rest))
    parts += [(look, np.flatnonzero(owner == i)) for i, look in enumerate(looks)]
    return [(look, faces) for look, faces in parts if faces is None or len(faces)]


def emit(ctx: Context, claim: Claim, surface: Surface, look: Look, faces: Ints | None) -> None:
    """Adds the shape of some faces of a surface."""
    uv = None
    if look.uv is not None:
        uv = surface.uv(look.uv)
        if uv is None:
            claim.approximated(
                f"primvars:{look.uv}", "the material reads it, and the mesh has no such texture coordinates", "(0, 0) everywhere"
            )
    triangles = surface.triangles(faces, uv, surface.colors() if look.colors else None)
    if len(triangles.indices) == 0:
        return
    stem = "".join(c if c.isalnum() else "_" for c in claim.prim.GetName())[:40]
    file = ctx.files.add(stem, ".glb", write(triangles))
    claim.group.add({"type": "gltf", "file": file, **look.shape}, claim.matrix)


