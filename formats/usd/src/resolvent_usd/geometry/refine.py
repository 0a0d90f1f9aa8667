"""A mesh's surface as it is shown: polygons, or a subdivided cage, with normals and texture coordinates per corner."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ..claim import Claim
from ..context import Context
from . import primvars, subdivide
from .glb import Triangles
from .polygons import triangulate
from .primvars import Primvar, Topology

Array = NDArray[Any]
Ints = NDArray[np.int64]
Floats = NDArray[np.float64]


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
        return _welded(self.points, self.indices, corners, self.normals, uv, colors)


def _welded(
    points: Array,
    indices: Ints,
    corners: Ints,
    normals: tuple[Array, Ints] | None,
    uv: tuple[Array, Ints] | None,
    colors: tuple[Array, Ints] | None,
) -> Triangles:
    """Corners that agree in everything become one vertex."""
    shared = [_shared(*a, indices, len(points)) for a in (normals, uv, colors) if a is not None]
    apart = [which for which in shared if which is not None]
    if not apart:
        # Everything hangs on the point.
        first = np.zeros(len(points), dtype=np.int64)
        first[indices[::-1]] = np.arange(len(indices))[::-1]

        def per_point(a: tuple[Array, Ints] | None) -> Array | None:
            return None if a is None else a[0][a[1][first]]

        return Triangles(points, indices[corners], per_point(normals), per_point(uv), per_point(colors))
    flat = corners.reshape(-1)
    key = indices[flat]
    for which in apart:
        key = _dense(key) * (int(which.max()) + 1) + which[flat]
    _, first, inverse = np.unique(key, return_index=True, return_inverse=True)
    source = flat[first]

    def pick(a: tuple[Array, Ints] | None) -> Array | None:
        return None if a is None else a[0][a[1][source]]

    return Triangles(points[indices[source]], inverse.reshape(-1, 3), pick(normals), pick(uv), pick(colors))


def _dense(key: Ints) -> Ints:
    """The same keys as small numbers, if they are large enough to overflow the next product."""
    if len(key) and int(key.max()) > 1 << 31:
        return np.asarray(np.unique(key, return_inverse=True)[1].reshape(-1))
    return key


def _shared(values: Array, which: Ints, indices: Ints, size: int) -> Ints | None:
    """The same values, corners with that of their point's first corner referring to it; None if all have it."""
    if which is indices:
        return None
    first = np.zeros(size, dtype=np.int64)
    first[indices[::-1]] = which[::-1]
    other = first[indices]
    differ = np.flatnonzero(other != which)
    own = differ[(values[other[differ]] != values[which[differ]]).any(axis=1)]
    if len(own) == 0:
        return None
    other[own] = which[own]
    return other


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
    if scheme == "none" or level == 0:
        if scheme != "none":
            claim.approximated("subdivisionScheme", "--subdivision 0", "the control cage is shown")
        return Surface(
            points, topology.counts, topology.indices, np.arange(len(topology.counts)), shown, flipped,
            None if normals is None else _unit(_flat(normals, topology)),
            lambda name, width: _polygon_data(claim, name, width, topology),
        )  # fmt: skip
    smooth = scheme != "bilinear"
    cage = rules.cage(topology, points)
    if smooth and rules.boundary == "none":
        shown &= ~_touches_boundary(topology)
    for _ in range(level):
        cage = subdivide.step(cage, smooth)
    if smooth:
        cage = subdivide.limit(cage)
    surface = Surface(
        cage.data.astype(np.float32), cage.counts, cage.indices, cage.face, shown[cage.face], flipped,
        None, lambda name, width: _subdivided_data(claim, name, width, topology, rules, level, smooth),
    )  # fmt: skip
    if smooth:
        values, which = subdivide.smooth_normals(cage, cage.data)
        surface.normals = (-values if flipped else values).astype(np.float32), which
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

        claim.take("triangleSubdivisionRule")
        if claim.get("triangleSubdivisionRule") == "smooth":
            claim.approximated("triangleSubdivisionRule", "only catmullClark is there", "triangles are rounded a little differently")
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

    def cage(self, topology: Topology, data: Array) -> subdivide.Cage:
        corner = np.zeros(topology.points)
        np.maximum.at(corner, self.corners, self.corner_sharpness)
        if self.boundary == "edgeAndCorner":
            # A corner of one face only stays where it is.
            corner[np.bincount(topology.indices, minlength=topology.points) == 1] = subdivide.INFINITE
        return subdivide.Cage(
            topology.counts, topology.indices, np.asarray(data, dtype=float), self.crease_edges, self.crease_sharpness,
            corner, np.arange(len(topology.counts)),
        )  # fmt: skip


def _touches_boundary(topology: Topology) -> NDArray[np.bool_]:
    """Faces that the boundary rule "none" leaves out: those with a vertex on a boundary."""
    cage = subdivide.Cage(
        topology.counts, topology.indices, np.zeros((topology.points, 0)), np.empty((0, 2), dtype=np.int64),
        np.empty(0), np.zeros(topology.points), np.arange(len(topology.counts)),
    )  # fmt: skip
    of_corner, sharp = subdivide.sharp_edges(cage)
    on_boundary = np.zeros(topology.points, dtype=bool)
    following = subdivide._next(topology.counts)
    edge = sharp[of_corner]
    on_boundary[topology.indices[edge]] = True
    on_boundary[topology.indices[following[edge]]] = True
    starts = np.cumsum(topology.counts) - topology.counts
    return np.asarray(np.logical_or.reduceat(on_boundary[topology.indices], starts))


def _unit(a: tuple[Array, Ints]) -> tuple[Array, Ints]:
    values = np.asarray(a[0], dtype=np.float64)
    length = np.linalg.norm(values, axis=1, keepdims=True)
    return np.where(length > 0, values / np.maximum(length, 1e-300), [0.0, 0.0, 1.0]).astype(np.float32), a[1]


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
    claim: Claim, name: str, width: int, topology: Topology, rules: _Rules, level: int, smooth: bool
) -> tuple[Array, Ints] | None:
    """A primvar on a subdivision surface: vertex data is smoothed like points, varying data is linear, faceVarying data
    follows faceVaryingLinearInterpolation."""
    found = _data_primvar(claim, name, width, topology)
    if found is None:
        return None
    values, which = _flat(found, topology)
    if found.interpolation == "vertex" and smooth:
        cage = rules.cage(topology, values)
    elif found.interpolation == "faceVarying" and smooth and rules.face_varying != "all":
        cage = _face_varying_cage(topology, values, rules)
    else:
        linear = rules.cage(topology, np.zeros((topology.points, 0)))
        cage = subdivide.Cage(**{**linear.__dict__, "corner": np.asarray(values[which], dtype=float)})
        for _ in range(level):
            cage = subdivide.step(cage, smooth=False)
        assert cage.corner is not None
        return cage.corner.astype(np.float32), np.arange(len(cage.corner))
    for _ in range(level):
        cage = subdivide.step(cage)
    cage = subdivide.limit(cage)
    return cage.data.astype(np.float32), cage.indices


def _face_varying_cage(topology: Topology, values: Array, rules: _Rules) -> subdivide.Cage:
    """The mesh of the texture coordinates: points split where neighbouring faces disagree, seams are its boundaries."""
    _, value = np.unique(values, axis=0, return_inverse=True)
    keys, first, inverse = np.unique(
        topology.indices * (int(value.max()) + 1) + value.reshape(-1), return_index=True, return_inverse=True
    )
    inverse = inverse.reshape(-1)
    size = len(keys)
    point = topology.indices[first]
    # Creases of the mesh hold where the coordinates are continuous: both of an edge's sides have the same two values.
    corner = np.zeros(size)
    regions = np.bincount(point, minlength=topology.points)
    if rules.face_varying in ("cornersOnly", "cornersPlus1", "cornersPlus2"):
        corner[np.bincount(inverse, minlength=size) == 1] = subdivide.INFINITE
    if rules.face_varying in ("cornersPlus1", "cornersPlus2"):
        # Where three regions or more meet.
        corner[regions[point] > 2] = subdivide.INFINITE
    cage = subdivide.Cage(
        topology.counts, inverse, np.asarray(values[first], dtype=float), np.empty((0, 2), dtype=np.int64), np.empty(0),
        corner, np.arange(len(topology.counts)),
    )  # fmt: skip
    if rules.face_varying == "boundaries":
        # All seams and boundaries are linear.
        of_corner, sharp = subdivide.sharp_edges(cage)
        following = subdivide._next(topology.counts)
        seam = sharp[of_corner]
        corner[inverse[seam]] = subdivide.INFINITE
        corner[inverse[following[seam]]] = subdivide.INFINITE
    return cage
