"""Inputs of surface shaders: constants, textures, and primvars."""

from __future__ import annotations

import os
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pxr import Ar, Sdf, Usd, UsdGeom

from ..report import InputError
from ..scene import Json
from ..shading import MAX_DEPTH, Link, Node, anchored, asset_of

if TYPE_CHECKING:
    from ..claim import Claim
    from ..context import Context

Array = NDArray[np.float64]


@dataclass(frozen=True)
class Value:
    """A constant, or a texture with a factor and an offset: texel · scale + bias."""

    constant: Array
    """Three numbers; what is left where there is no texture."""
    texture: Json | None = None
    """The scene's texture without ``scale`` and ``bias``."""
    scale: Array | None = None
    bias: Array | None = None

    def times(self, factor: Any) -> Value:
        f = three(factor)
        if self.texture is None:
            return replace(self, constant=self.constant * f)
        scale = np.ones(3) if self.scale is None else self.scale
        bias = np.zeros(3) if self.bias is None else self.bias
        return replace(self, scale=scale * f, bias=bias * f)

    def plus(self, summand: Any) -> Value:
        s = three(summand)
        if self.texture is None:
            return replace(self, constant=self.constant + s)
        return replace(self, bias=(np.zeros(3) if self.bias is None else self.bias) + s)

    @property
    def is_constant(self) -> bool:
        return self.texture is None

    @property
    def number(self) -> float:
        return float(self.constant[0])

    def is_just(self, value: Any) -> bool:
        """True for a constant of this value."""
        return self.texture is None and bool(np.allclose(self.constant, three(value), atol=1e-9))


def _affine(linear: Any, move: Any) -> Array:
    out: Array = np.eye(3)
    out[:2, :2], out[:2, 2] = linear, move
    return out


def _turn(degrees: float) -> Array:
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    return np.array([[c, -s], [s, c]])


def _pair(node: Node, name: str, plain: float) -> Array:
    return np.asarray(node.value(name, (plain, plain)), dtype=float)


def _transform2d(node: Node) -> Array:
    """UsdTransform2d: scaled, turned counter-clockwise, moved."""
    return _affine(_turn(float(node.value("rotation", 0.0))) @ np.diag(_pair(node, "scale", 1.0)), _pair(node, "translation", 0.0))


def _place2d(node: Node) -> Array:
    """MaterialX: around the pivot, divided by the scale, turned clockwise, the offset subtracted; or in the opposite order."""
    pivot, scale, offset = (_pair(node, name, plain) for name, plain in (("pivot", 0.0), ("scale", 1.0), ("offset", 0.0)))
    turn, shrink = _affine(_turn(-float(node.value("rotate", 0.0))), 0.0), _affine(np.diag(1.0 / np.where(scale == 0.0, 1.0, scale)), 0.0)
    move = _affine(np.eye(2), -offset)
    order = move @ turn @ shrink if int(node.value("operationorder", 0)) == 0 else shrink @ turn @ move
    return np.asarray(_affine(np.eye(2), pivot) @ order @ _affine(np.eye(2), -pivot))


def three(value: Any) -> Array:
    """One number or three as three."""
    array = np.asarray(value, dtype=float).reshape(-1)
    return np.repeat(array, 3) if array.size == 1 else array[:3].copy()


class Builder:
    """Reads the inputs of one material for one prim."""

    def __init__(self, ctx: Context, claim: Claim, material: Usd.Prim, subset: Claim | None = None) -> None:
        self.ctx = ctx
        self.claim = claim
        self.material = material
        self.subset = subset
        self.uv: str | None = None
        """The primvar that textures are read at."""
        self.of_the_prim = False
        """True if the material differs from prim to prim, by its primvars."""
        self.colors = False
        """True if it reads the colours at the mesh's corners, displayColor and displayOpacity."""

    def read(self, node: Node, name: str, default: Any) -> Value:
        """An input of a shader."""
        link = node.link(name)
        if link is None:
            value = node.value(name)
            return Value(three(default if value is None else value))
        found = self._of(link, 0)
        if found is not None:
            return found
        node.claim.approximated(
            f"inputs:{name}", f"{link.node.described} is connected, which can't be computed", f"it is taken as {three(default).tolist()}"
        )
        return Value(three(default))

    def _of(self, link: Link, depth: int) -> Value | None:
        """What a node gives; None for one that is unknown."""
        node = link.node
        if depth > MAX_DEPTH:
            raise InputError(node.path, "the shader network has no end: its nodes are connected in a circle")
        kind = kind_of(node)
        if kind == "UsdUVTexture":
            return self._uv_texture(node, link.output)
        if kind.startswith("UsdPrimvarReader") or kind in ("geompropvalue", "geomcolor"):
            return self._primvar(node, kind)
        if kind in ("image", "tiledimage"):
            return self._image(node, kind)
        if kind == "constant":
            return self._inner(node, "value", 0.0, depth)
        if kind in ("convert", "dot"):
            return self._inner(node, "in", 0.0, depth)
        if kind in ("multiply", "add"):
            a, b = self._inner(node, "in1", 0.0, depth), self._inner(node, "in2", 1.0 if kind == "multiply" else 0.0, depth)
            if a is None or b is None or not (a.is_constant or b.is_constant):
                return None
            a, b = (b, a) if a.is_constant else (a, b)
            return a.times(b.constant) if kind == "multiply" else a.plus(b.constant)
        if kind in ("combine2", "combine3", "combine4"):
            parts = [self._inner(node, f"in{i}", 0.0, depth) for i in range(1, int(kind[-1]) + 1)]
            if any(part is None or not part.is_constant for part in parts):
                return None
            return Value(np.array([*(part.number for part in parts if part is not None), 0.0])[:3])
        if kind in ("extract", "separate3", "separate4", "separate2"):
            inner = self._inner(node, "in", 0.0, depth)
            if inner is None:
                return None
            index = int(node.value("index", 0)) if kind == "extract" else _OUTPUTS.get(link.output, 0)
            if inner.texture is None:
                return Value(np.repeat(inner.constant[min(index, 2)], 3))
            k = min(index, 2)
            scale = None if inner.scale is None else np.repeat(inner.scale[k], 3)
            bias = None if inner.bias is None else np.repeat(inner.bias[k], 3)
            return Value(inner.constant, {**inner.texture, "channel": "rgba"[index]}, scale, bias)
        return None

    def _inner(self, node: Node, name: str, default: Any, depth: int) -> Value | None:
        link = node.link(name)
        if link is not None:
            return self._of(link, depth + 1)
        value = node.value(name)
        return Value(three(default if value is None else value))

    # Textures

    def _uv_texture(self, node: Node, output: str) -> Value:
        file = self.image(node, "file")
        fallback = np.asarray(node.value("fallback", (0.0, 0.0, 0.0, 1.0)), dtype=float)
        scale = np.asarray(node.value("scale", (1.0,) * 4), dtype=float)
        bias = np.asarray(node.value("bias", (0.0,) * 4), dtype=float)
        channel = output if output in ("r", "g", "b", "a") else None
        index = {"r": 0, "g": 1, "b": 2, "a": 3}.get(output)
        if file is None:
            return Value(fallback[:3] if index is None else np.repeat(fallback[index], 3))
        texture: Json = {"file": file}
        space = str(node.value("sourceColorSpace", "auto"))
        if space in ("raw", "sRGB"):
            texture["color_space"] = "raw" if space == "raw" else "srgb"
        for axis in ("S", "T"):
            mode = str(node.value(f"wrap{axis}", "useMetadata"))
            # The specification: without metadata in the file, black.
            texture["wrap_" + ("u" if axis == "S" else "v")] = _WRAPS.get(mode, "black")
        texture |= self._transform(node, self._place(node, "st"))
        if channel is not None:
            texture["channel"] = channel
            return Value(np.repeat(fallback[index], 3), texture, np.repeat(scale[index], 3), np.repeat(bias[index], 3))
        return Value(fallback[:3], texture, scale[:3], bias[:3])

    def _image(self, node: Node, kind: str) -> Value:
        default = three(node.value("default", 0.0))
        file = self.image(node, "file")
        if file is None:
            return Value(default)
        texture: Json = {"file": file}
        attribute = node.attribute("file")
        space = str(attribute.GetColorSpace()) if attribute is not None and attribute.HasColorSpace() else ""
        floats = not node.id.endswith(("_color3", "_color4"))
        if floats or space.lower() in ("raw", "lin_rec709", "linear", "none", "data", "lin_rec709_scene"):
            texture["color_space"] = "raw"
        elif space.lower() in ("srgb_texture", "srgb", "srgb_tx", "srgb_rec709_scene"):
            texture["color_space"] = "srgb"
        elif space:
            node.claim.approximated("inputs:file", f"the colour space '{space}' is not converted", "8 and 16 bits are read as sRGB")
        for axis in ("u", "v"):
            mode = str(node.value(f"{axis}addressmode", "periodic"))
            texture[f"wrap_{axis}"] = _ADDRESS.get(mode, "repeat")
        if str(node.value("filtertype", "linear")) == "closest":
            texture["filter"] = "nearest"
        place = self._place(node, "texcoord")
        if kind == "tiledimage":
            tiling, offset, image_size, tile_size = (
                np.asarray(node.value(name, (plain, plain)), dtype=float)
                for name, plain in (("uvtiling", 1.0), ("uvoffset", 0.0), ("realworldimagesize", 1.0), ("realworldtilesize", 1.0))
            )
            size = tile_size / np.where(image_size == 0.0, 1.0, image_size)
            place = _affine(np.diag(tiling * size), -offset * size) @ place
        texture |= self._transform(node, place)
        for name in ("layer", "framerange", "frameoffset", "frameendaction"):
            node.claim.no_effect(f"inputs:{name}", "this setting of images is not there", "the image is shown as it is")
        return Value(default, texture)

    def image(self, node: Node, name: str) -> str | None:
        """The scene's name of an image file; None where the shader has none."""
        found = asset_of(node, name)
        if found is None:
            return None
        asset, attribute = found
        if "<UDIM>" in asset.path:
            return self._tiles(node, name, asset, attribute)
        if not asset.resolvedPath:
            raise InputError(attribute.GetPath(), f"can't find the file '{asset.path}'")
        return self.ctx.plain_file(node.claim, f"inputs:{name}", str(asset.resolvedPath))

    def _tiles(self, node: Node, name: str, asset: Sdf.AssetPath, attribute: Any) -> str:
        """A pattern of tiles, which the renderer fills in."""
        path = anchored(asset.path, attribute)
        folder, file = os.path.split(path)
        before, _, after = file.partition("<UDIM>")
        if Ar.IsPackageRelativePath(path) or not os.path.isdir(folder):
            raise InputError(attribute.GetPath(), f"can't find the tiles '{asset.path}': only those in folders are read")
        if not any(
            f.startswith(before) and f.endswith(after) and f[len(before) : len(f) - len(after)].isdigit() for f in os.listdir(folder)
        ):
            raise InputError(attribute.GetPath(), f"there is no tile '{asset.path}' in {folder}")
        return self.ctx.files.relative(path)

    def _place(self, node: Node, name: str) -> Array:
        """Texture coordinates: the primvar goes to ``uv``, what transforms it is returned (3×3)."""
        link = node.link(name)
        place: Array = np.eye(3)
        for _ in range(MAX_DEPTH):
            if link is None:
                break
            inner = link.node
            kind = kind_of(inner)
            if kind == "UsdTransform2d":
                place = place @ _transform2d(inner)
                link = inner.link("in")
                continue
            if kind == "place2d":
                place = place @ _place2d(inner)
                link = inner.link("texcoord")
                continue
            if kind.startswith("UsdPrimvarReader") or kind == "geompropvalue":
                inner.claim.take("inputs:fallback", "inputs:default")
                self._use_uv(node, str(inner.value("varname") or inner.value("geomprop") or "st"))
                return place
            if kind == "texcoord":
                index = int(inner.value("index", 0))
                self._use_uv(node, "st" if index == 0 else f"st{index}")
                return place
            node.claim.approximated(
                f"inputs:{name}", f"{inner.described} is connected, which gives no texture coordinates that are known", "primvar st is used"
            )
            break
        else:
            raise InputError(node.path, "the shader network has no end: its nodes are connected in a circle")
        self._use_uv(node, "st")
        return place

    @staticmethod
    def _transform(node: Node, place: Array) -> Json:
        """The scene's scale, rotation and offset of a matrix."""
        if np.allclose(place, np.eye(3), rtol=0, atol=1e-12):
            return {}
        (a, b), (c, d) = place[:2, :2]
        width = float(np.hypot(a, c))
        if width == 0.0 or abs(a * b + c * d) > 1e-6 * max(width**2, b * b + d * d):
            node.claim.approximated("inputs:texcoord", "its texture coordinates are sheared", "only turned, scaled and moved")
        angle = float(np.degrees(np.arctan2(c, a)))
        scale = [width, (a * d - b * c) / width if width > 0.0 else float(np.hypot(b, d))]
        # Half a turn of mirrored coordinates is a mirror of the others: the smaller angle is the plainer one.
        if abs(angle) > 90.0:
            angle, scale = angle - np.copysign(180.0, angle), [-x for x in scale]
        out = {"scale": scale, "rotation_deg": angle, "offset": place[:2, 2]}
        return {"uv_transform": {k: np.round(np.asarray(v, dtype=float), 9).tolist() for k, v in out.items()}}

    def _use_uv(self, node: Node, name: str) -> None:
        if self.uv is None:
            self.uv = name
        elif self.uv != name:
            node.claim.approximated(
                "inputs:st", f"reads the primvar '{name}', another texture of the material '{self.uv}'", f"both use '{self.uv}'"
            )

    # Primvars

    def _primvar(self, node: Node, kind: str) -> Value:
        """A primvar of the prim: its value if it is constant, else its mean."""
        self.of_the_prim = True
        name = str(node.value("varname") or node.value("geomprop") or ("displayColor" if kind == "geomcolor" else ""))
        fallback = node.value("fallback", node.value("default", 0.0))
        primvar = self._found(name)
        value = primvar.ComputeFlattened(self.ctx.time) if primvar else None
        if primvar is None or value is None:
            return Value(three(fallback))
        self.ctx.used.add((str(primvar.GetAttr().GetPrimPath()), primvar.GetName()))
        self.ctx.used.add((str(primvar.GetAttr().GetPrimPath()), primvar.GetName() + ":indices"))
        array = np.asarray(value, dtype=float)
        if array.ndim == 0 or primvar.GetTypeName().type.typeName.startswith("Gf"):
            return Value(three(array))
        array = array.reshape(len(array), -1) if len(array) else np.zeros((1, 1))
        if len(array) > 1 and np.ptp(array, axis=0).max() > 0.0:
            if name in _CORNERS and self.claim.prim.GetTypeName() == "Mesh":
                self.colors = True
                return Value(three(array.mean(axis=0)), dict(_CORNERS[name]))
            self.claim.approximated(
                f"primvars:{name}", f"the material {node.path} reads it, and it varies over the surface", "its mean is shown"
            )
        return Value(three(array.mean(axis=0)))

    def _found(self, name: str) -> UsdGeom.Primvar | None:
        """A primvar of the subset, else of the prim or those above it, else the one that the material brings along."""
        if self.subset is not None and (own := UsdGeom.PrimvarsAPI(self.subset.prim).GetPrimvar(name)) and own.HasAuthoredValue():
            return own
        if (found := UsdGeom.PrimvarsAPI(self.claim.prim).FindPrimvarWithInheritance(name)) and found.HasValue():
            return found
        brought = UsdGeom.PrimvarsAPI(self.material).GetPrimvar(name)
        return brought if brought and brought.HasAuthoredValue() else None

    # To the scene

    def parameter(self, name: str, value: Value, low: float, high: float, number: bool) -> Any:
        """A plugin's parameter: constants limited to its range, textures by name."""
        if value.texture is None:
            limited = np.clip(value.constant, low, high)
            return _short(limited[0]) if number or np.ptp(limited) == 0.0 else [_short(x) for x in limited]
        return {"texture": self.texture(name, value)}

    def texture(self, name: str, value: Value) -> str:
        """The scene's name of a texture."""
        texture: Json = dict(value.texture or {})
        for key, factor, plain in (("scale", value.scale, 1.0), ("bias", value.bias, 0.0)):
            if factor is not None and not np.allclose(factor, plain, atol=1e-12):
                texture[key] = _short(factor[0]) if np.ptp(factor) == 0.0 else [_short(x) for x in factor]
        return self.ctx.scene.texture(name, texture)


_CORNERS: dict[str, Json] = {"displayColor": {"vertex_color": True}, "displayOpacity": {"vertex_color": True, "channel": "a"}}
_OUTPUTS = {"outr": 0, "outx": 0, "outg": 1, "outy": 1, "outb": 2, "outz": 2, "outa": 3, "outw": 3}
_WRAPS = {"black": "black", "clamp": "clamp", "repeat": "repeat", "mirror": "mirror"}
_ADDRESS = {"constant": "black", "clamp": "clamp", "periodic": "repeat", "mirror": "mirror"}


def kind_of(node: Node) -> str:
    """The sort of a node, without MaterialX's prefix and types: "image", "multiply", "UsdUVTexture"."""
    name = node.id
    if name.startswith("ND_"):
        name = name[3:]
        if name.startswith("Usd"):
            return name.rsplit("_23", 1)[0]
        return name.split("_")[0]
    return name.split(":")[-1]


def _short(x: float) -> float:
    """Without the digits that single precision made up."""
    return float(np.format_float_positional(np.float32(x), unique=True, trim="0")) if np.isfinite(x) else 0.0
