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
from .glb import Triangles, compact
from .polygons import triangulate
from .primvars import Primvar, Topology

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
        return _welded(self.points, self.indices, corners, self.normals, uv, colors)


def _welded(
    points: Array,
    indices: Ints,
    corners: Ints,
    normals: tuple[Array, Ints] | None,
    uv: tuple[Array, Ints] | None,
    colors: tuple[Array, Ints] | None,
) -> Triangles:
    """Corners of a point that have in everything what its first corner has become one vertex with it."""
    attributes = (normals, uv, colors)
    apart = [a for a in attributes if a is not None and a[1] is not indices]
    if apart:
        first = _first_corners(indices, len(points))
        shared = _shared(apart, indices, first)
        if shared is not None:
            source, vertex = shared
            if len(source) == len(indices):
                return compact(Triangles(points.take(indices, axis=0), corners, *map(_whole, attributes)))
            place = points.take(indices.take(source), axis=0)
            return compact(Triangles(place, vertex.take(corners), *(_taken(a, source) for a in attributes)))

    # Everything hangs on the point.
    def per_point(a: tuple[Array, Ints] | None) -> Array | None:
        if a is None or a[1] is indices:
            return None if a is None else a[0]
        return a[0].take(a[1].take(first), axis=0)

    return compact(Triangles(points, indices.take(corners), *(per_point(a) for a in attributes)))


def _taken(a: tuple[Array, Ints] | None, corners: Ints) -> Array | None:
    """The values at some corners."""
    return None if a is None else a[0].take(a[1].take(corners), axis=0)


def _whole(a: tuple[Array, Ints] | None) -> Array | None:
    """The values at all corners."""
    if a is None or _one_each(a[1]):
        return None if a is None else a[0]
    return a[0].take(a[1], axis=0)


def _first_corners(indices: Ints, size: int) -> Ints:
    """For each point its first corner (0 for those without)."""
    first = np.zeros(size, dtype=np.int64)
    first[indices[::-1]] = np.arange(len(indices) - 1, -1, -1)
    return first


def _shared(attributes: list[tuple[Array, Ints]], indices: Ints, first: Ints) -> tuple[Ints, Ints] | None:
    """Vertices, in the order of their first corners: those corners, and for each corner its vertex. None if points are enough."""
    leader = first.take(indices)
    different = [_differ(values, which, which.take(leader)) for values, which in attributes]
    own = np.logical_or.reduce(different)
    if not own.any():
        return None
    alone = np.zeros(len(indices), dtype=bool)
    for (_, which), differs in zip(attributes, different, strict=True):
        if _one_each(which):
            alone |= differs
    leads = leader.copy()
    leads[own] = np.flatnonzero(own)
    # Others that differ from the first may be alike: where all that they have was given to several corners by one number.
    if len(rest := np.flatnonzero(own & ~alone)):
        key = indices[rest]
        for (_, which), differs in zip(attributes, different, strict=True):
            numbers = np.where(differs[rest], which[rest], which[leader[rest]])
            key = np.unique(key, return_inverse=True)[1] * (int(which.max()) + 1) + numbers
        _, least, group = np.unique(key, return_index=True, return_inverse=True)
        leads[rest] = rest[least][group]
    return _numbered(leads)


def _numbered(leads: Ints) -> tuple[Ints, Ints]:
    """Of corners that each have a leading one: those that lead, and for each corner the number of its own."""
    leading = np.zeros(len(leads), dtype=bool)
    leading[leads] = True
    return np.flatnonzero(leading), (np.cumsum(leading) - 1).take(leads)


def _one_each(which: Ints) -> bool:
    """True if every corner has a value of its own."""
    return len(which) > 0 and int(which[-1]) == len(which) - 1 and np.array_equal(which, np.arange(len(which)))


def _differ(values: Array, a: Ints, b: Ints) -> NDArray[np.bool_]:
    """True where rows a and b of the values differ."""
    out: NDArray[np.bool_] = a != b
    at = np.flatnonzero(out)
    other = values.take(a.take(at), axis=0) != values.take(b.take(at), axis=0)
    out[at] = other[:, 0] if other.shape[1] == 1 else np.logical_or.reduce(list(other.T))
    return out


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
        _single(cage.data), cage.counts, cage.indices, cage.face, shown[cage.face], flipped,
        None, lambda name, width: _subdivided_data(claim, name, width, topology, rules, level, smooth),
    )  # fmt: skip
    if smooth:
        values, which = subdivide.smooth_normals(cage, cage.data)
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


def _single(values: Array) -> Array:
    """In single precision, row by row."""
    return np.ascontiguousarray(values, dtype=np.float32)


def _touches_boundary(topology: Topology) -> NDArray[np.bool_]:
    """Faces that the boundary rule "none" leaves out: those with a vertex on a boundary."""
    cage = subdivide.Cage(
        topology.counts, topology.indices, np.zeros((topology.points, 0)), np.empty((0, 2), dtype=np.int64),
        np.empty(0), np.zeros(topology.points), np.arange(len(topology.counts)),
    )  # fmt: skip
    of_corner, sharp = subdivide.sharp_edges(cage)
    on_boundary = np.zeros(topology.points, dtype=bool)
    following = subdivide.following(topology.counts)
    edge = sharp[of_corner]
    on_boundary[topology.indices[edge]] = True
    on_boundary[topology.indices[following[edge]]] = True
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
        counts, corners = topology.counts, np.ascontiguousarray(values[which].T, dtype=float)
        for _ in range(level):
            corners, counts = subdivide.linear(counts, corners), np.full(corners.shape[1], 4)
        return _single(corners.T), np.arange(corners.shape[1])
    for _ in range(level):
        cage = subdivide.step(cage)
    cage = subdivide.limit(cage)
    return _single(cage.data), cage.indices


def _welds(topology: Topology, values: Array) -> tuple[Ints, Ints]:
    """Corners of a point with equal values are one: the first corners, and for each corner the number of its own."""
    indices = topology.indices
    leads, rest = np.arange(len(indices)), np.arange(len(indices))
    # Most have what the first one has, or the first of those that have not.
    for _ in range(8):
        here = indices.take(rest)
        leader = rest.take(_first_corners(here, topology.points).take(here))
        differs = _differ(values, rest, leader)
        leads[rest] = leader
        rest = rest[differs]
        if len(rest) == 0:
            break
    else:
        rest = rest[np.lexsort((*values[rest].T, indices[rest]))]
        new = np.ones(len(rest), dtype=bool)
        new[1:] = _differ(values, rest[1:], rest[:-1]) | (indices[rest[1:]] != indices[rest[:-1]])
        leads[rest] = rest[new][np.cumsum(new) - 1]
    return _numbered(leads)


def _face_varying_cage(topology: Topology, values: Array, rules: _Rules) -> subdivide.Cage:
    """The mesh of the texture coordinates: points split where neighbouring faces disagree, seams are its boundaries."""
    first, inverse = _welds(topology, values)
    size = len(first)
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
        following = subdivide.following(topology.counts)
        seam = sharp[of_corner]
        corner[inverse[seam]] = subdivide.INFINITE
        corner[inverse[following[seam]]] = subdivide.INFINITE
    return cage
