"""A mesh's surface as it is shown: polygons, or a subdivided cage, with normals and texture coordinates per corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field, replace
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..claim import Claim
from ..context import Context
from . import loop, primvars, subdivide
from .cage import INFINITE, Cage, following, sharp_edges
from .glb import Triangles
from .normals import smooth_normals
from .polygons import triangulate
from .primvars import Primvar, Topology
from .weld import welded, welds

Array = NDArray[Any]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]

PART = 1 << 16
"""Elements that are worked on at once where that spares memory's bandwidth."""


@dataclass
class Surface:
    """Polygons with data per corner."""

    points: Array
    counts: Ints
    indices: Ints
    face: Ints
    """Face of the stage's mesh that each polygon comes from."""
    shown: NDArray[np.bool_]
    """False for holes."""
    flipped: bool
    normals: tuple[Array, Ints] | None
    """Values, and for each corner which."""
    read: Callable[[str, int], tuple[Array, Ints] | None]
    """A primvar of so many components: values, and for each corner which."""
    _cut: tuple[Ints, Ints] | None = None
    _uvs: dict[str, tuple[Array, Ints] | None] = field(default_factory=dict)

    def uv(self, name: str) -> tuple[Array, Ints] | None:
        """Texture coordinates of a primvar: values, and for each corner which."""
        if name not in self._uvs:
            self._uvs[name] = self.read(name, 2)
        return self._uvs[name]

    def colors(self) -> tuple[Array, Ints] | None:
        """Linear RGB and opacity of displayColor and displayOpacity: values, and for each corner which."""
        color, opacity = self.read("displayColor", 3), self.read("displayOpacity", 1)
        if color is None and opacity is None:
            return None
        count = len(self.indices)
        rgb = np.full((count, 3), 0.18, dtype=np.float32) if color is None else color[0][color[1]]
        alpha = np.ones((count, 1), dtype=np.float32) if opacity is None else opacity[0][opacity[1]]
        return np.clip(np.concatenate([rgb, alpha], axis=1), 0.0, 1.0), np.arange(count)

    def triangles(
        self, faces: Ints | None, uv: tuple[Array, Ints] | None, colors: tuple[Array, Ints] | None = None
    ) -> Triangles:
        """The triangles of some faces of the stage's mesh (None: all)."""
        if self._cut is None:
            self._cut = triangulate(self.points, self.counts, self.indices)
        corners, polygon = self._cut
        keep = self.shown
        if faces is not None:
            wanted = np.zeros(int(self.face.max()) + 1, dtype=bool)
            wanted[faces] = True
            keep = keep & wanted[self.face]
        if not keep.all():
            corners = corners[keep[polygon]]
        if self.flipped:
            corners = corners[:, ::-1]
        return welded(self.points, self.indices, corners, self.normals, uv, colors)


def refine(
    ctx: Context,
    claim: Claim,
    topology: Topology,
    points: Array,
    scheme: str,
    flipped: bool,
    normals: Primvar | None,
    holes: Ints | None,
) -> Surface:
    """The surface of a mesh under its subdivision scheme."""
    shown = np.ones(len(topology.counts), dtype=bool)
    if holes is not None:
        shown[holes] = False
    level = 0 if scheme == "none" else ctx.options.subdivision
    rules = _Rules.read(claim)
    claim.take("triangleSubdivisionRule")
    if scheme == "none" or level == 0:
        if scheme != "none":
            claim.approximated("subdivisionScheme", "--subdivision 0", "the control cage is shown")
        return Surface(
            points, topology.counts, topology.indices, np.arange(len(topology.counts)), shown, flipped,
            None if normals is None else _unit(_flat(normals, topology)),
            lambda name, width: _polygon_data(claim, name, width, topology),
        )  # fmt: skip
    if claim.get("triangleSubdivisionRule") == "smooth" and scheme == "catmullClark" and topology.counts.min() == 3:
        claim.approximated("triangleSubdivisionRule", "only catmullClark is there", "triangles are rounded a little differently")
    smooth = scheme != "bilinear"
    cage = rules.cage(topology, points)
    if smooth and rules.boundary == "none":
        shown &= ~_touches_boundary(topology)
    how = loop if scheme == "loop" else subdivide
    for _ in range(level):
        cage = how.step(cage) if smooth else subdivide.step(cage, smooth=False)
    if smooth:
        cage = how.limit(cage)
    surface = Surface(
        _single(cage.data), cage.counts, cage.indices, cage.face, shown[cage.face], flipped,
        None, lambda name, width: _subdivided_data(claim, name, width, topology, rules, level, how if smooth else None),
    )  # fmt: skip
    if smooth:
        values, which = smooth_normals(cage, cage.data)
        surface.normals = _single(-values if flipped else values), which
    return surface


@dataclass(frozen=True)
class _Rules:
    """What a mesh says about its subdivision."""

    boundary: str
    face_varying: str
    crease_edges: Ints
    crease_sharpness: Floats
    corners: Ints
    corner_sharpness: Floats

    @staticmethod
    def read(claim: Claim) -> _Rules:
        from ..report import InputError

        def ints(name: str) -> Ints:
            value = claim.array(name, np.int64)
            return np.empty(0, dtype=np.int64) if value is None else value

        def floats(name: str) -> Floats:
            value = claim.array(name)
            return np.empty(0) if value is None else value

        lengths, sharpness, indices = ints("creaseLengths"), floats("creaseSharpnesses"), ints("creaseIndices")
        points = claim.array("points", np.float32, 3)
        count = 0 if points is None else len(points)
        if lengths.sum() != len(indices) or (len(lengths) and lengths.min() < 2):
            raise InputError(f"{claim.path}.creaseIndices", f"has {len(indices)} elements where creaseLengths adds up to {lengths.sum()}")
        inside = np.ones(len(indices), dtype=bool)
        inside[np.cumsum(lengths) - 1] = False
        at = np.flatnonzero(inside)
        edges = np.stack([indices[at], indices[at + 1]], axis=1) if len(at) else np.empty((0, 2), dtype=np.int64)
        if len(sharpness) == len(lengths):
            sharpness = np.repeat(sharpness, lengths - 1)
        elif len(sharpness) != len(edges):
            raise InputError(
                f"{claim.path}.creaseSharpnesses",
                f"has {len(sharpness)} elements for {len(lengths)} creases of {len(edges)} edges",
            )
        corners, corner_sharpness = ints("cornerIndices"), floats("cornerSharpnesses")
        if len(corners) != len(corner_sharpness):
            raise InputError(f"{claim.path}.cornerSharpnesses", f"has {len(corner_sharpness)} elements for {len(corners)} corners")
        for name, which in (("creaseIndices", indices), ("cornerIndices", corners)):
            if len(which) and (which.min() < 0 or which.max() >= count):
                raise InputError(f"{claim.path}.{name}", f"names a point that is not there; there are {count}")
        return _Rules(
            str(claim.get("interpolateBoundary")), str(claim.get("faceVaryingLinearInterpolation")),
            edges, sharpness, corners, corner_sharpness,
        )  # fmt: skip

    def cage(self, topology: Topology, data: Array) -> Cage:
        return Cage(
            topology.counts, topology.indices, np.asarray(data, dtype=float), self.crease_edges, self.crease_sharpness,
            self.corner(topology), np.arange(len(topology.counts)),
        )  # fmt: skip

    def corner(self, topology: Topology) -> Floats:
        """Sharpness of the points."""
        corner = np.zeros(topology.points)
        np.maximum.at(corner, self.corners, self.corner_sharpness)
        if self.boundary == "edgeAndCorner":
            # A corner of one face only stays where it is.
            corner[np.bincount(topology.indices, minlength=topology.points) == 1] = INFINITE
        return corner


def _single(values: Array) -> Array:
    """In single precision, row by row."""
    return np.ascontiguousarray(values, dtype=np.float32)


def _touches_boundary(topology: Topology) -> NDArray[np.bool_]:
    """Faces that the boundary rule "none" leaves out: those with a vertex on a boundary."""
    cage = Cage(
        topology.counts, topology.indices, np.zeros((topology.points, 0)), np.empty((0, 2), dtype=np.int64),
        np.empty(0), np.zeros(topology.points), np.arange(len(topology.counts)),
    )  # fmt: skip
    of_corner, sharp = sharp_edges(cage)
    on_boundary = np.zeros(topology.points, dtype=bool)
    after = following(topology.counts)
    edge = sharp[of_corner]
    on_boundary[topology.indices[edge]] = True
    on_boundary[topology.indices[after[edge]]] = True
    starts = np.cumsum(topology.counts) - topology.counts
    return np.asarray(np.logical_or.reduceat(on_boundary[topology.indices], starts))


def _unit(a: tuple[Array, Ints]) -> tuple[Array, Ints]:
    out = np.empty(a[0].shape, dtype=np.float32)
    # Parts that stay in the cache.
    for start in range(0, len(out), PART):
        x, y, z = np.asarray(a[0][start : start + PART], dtype=float).T
        length = np.sqrt((x * x + y * y) + z * z)
        flat = length == 0.0
        length[flat] = 1.0
        for k, column in enumerate((x, y, np.where(flat, 1.0, z))):
            out[start : start + PART, k] = column / length
    return out, a[1]


def _flat(primvar: Primvar, topology: Topology) -> tuple[Array, Ints]:
    """Values, and for each corner which."""
    corners = len(topology.indices)
    match primvar.interpolation:
        case "constant":
            return primvar.values, np.zeros(corners, dtype=np.int64)
        case "uniform":
            return primvar.values, np.repeat(np.arange(len(topology.counts)), topology.counts)
        case "faceVarying":
            return primvar.values, np.arange(corners)
        case _:
            return primvar.values, topology.indices


def _data_primvar(claim: Claim, name: str, width: int, topology: Topology) -> Primvar | None:
    found = primvars.read(claim, name)
    if found is None:
        return None
    found = primvars.checked(claim, found, topology)
    if found is None:
        return None
    values = np.asarray(found.values, dtype=np.float32)
    values = values.reshape(len(values), -1)
    if values.shape[1] < width:
        claim.skipped(f"primvars:{name}", f"has {values.shape[1]} components, not {width}", "it has no effect")
        return None
    return Primvar(name, values[:, :width], found.interpolation)


def _polygon_data(claim: Claim, name: str, width: int, topology: Topology) -> tuple[Array, Ints] | None:
    found = _data_primvar(claim, name, width, topology)
    return None if found is None else _flat(found, topology)


def _subdivided_data(
    claim: Claim, name: str, width: int, topology: Topology, rules: _Rules, level: int, scheme: ModuleType | None
) -> tuple[Array, Ints] | None:
    """A primvar on a subdivision surface: vertex data is smoothed like points, varying data is linear, faceVarying data
    follows faceVaryingLinearInterpolation; without a scheme all is linear."""
    found = _data_primvar(claim, name, width, topology)
    if found is None:
        return None
    values, which = _flat(found, topology)
    how = scheme or subdivide
    if found.interpolation == "vertex" and scheme:
        cage = rules.cage(topology, values)
    elif found.interpolation == "faceVarying" and scheme and rules.face_varying != "all":
        cage = _face_varying_cage(topology, values, rules)
    else:
        counts, corners = topology.counts, np.ascontiguousarray(values[which].T, dtype=float)
        for _ in range(level):
            counts, corners = how.linear(counts, corners)
        return _single(corners.T), np.arange(corners.shape[1])
    for _ in range(level):
        cage = how.step(cage)
    cage = how.limit(cage)
    return _single(cage.data), cage.indices


def _face_varying_cage(topology: Topology, values: Array, rules: _Rules) -> Cage:
    """The mesh of the texture coordinates: points split where neighbouring faces disagree, seams are its boundaries."""
    first, inverse = welds(topology, values)
    size = len(first)
    point = topology.indices[first]
    regions = np.bincount(point, minlength=topology.points)[point]
    # A point with one value keeps its own sharpness; one that is sharp for ever keeps all its values where they are.
    own = rules.corner(topology)[point]
    corner = np.where((regions == 1) | (own >= INFINITE), own, 0.0)
    if rules.face_varying in ("cornersOnly", "cornersPlus1", "cornersPlus2"):
        corner[np.bincount(inverse, minlength=size) == 1] = INFINITE
    if rules.face_varying in ("cornersPlus1", "cornersPlus2"):
        # Where three regions or more meet.
        corner[regions > 2] = INFINITE
    cage = Cage(
        topology.counts, inverse, np.asarray(values[first], dtype=float), np.empty((0, 2), dtype=np.int64), np.empty(0),
        corner, np.arange(len(topology.counts)),
    )  # fmt: skip
    if rules.face_varying == "boundaries":
        # All seams and boundaries are linear.
        of_corner, sharp = sharp_edges(cage)
        after = following(topology.counts)
        seam = sharp[of_corner]
        corner[inverse[seam]] = INFINITE
        corner[inverse[after[seam]]] = INFINITE
    if len(rules.crease_edges):
        # The mesh's creases hold where the coordinates are continuous; elsewhere there is a seam, which is sharp anyway.
        mesh, edges = rules.cage(topology, np.empty((topology.points, 0))).edges, cage.edges
        sharpness = np.zeros(len(edges.ends))
        np.maximum.at(sharpness, edges.of_corner, mesh.sharpness[mesh.of_corner])
        at = np.flatnonzero(sharpness)
        cage = replace(cage, crease_edges=edges.ends[at], crease_sharpness=sharpness[at])
    return cage
