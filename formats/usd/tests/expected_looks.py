"""What UsdShade says that surfaces look like, in the terms of ``principled``, beside what a scene says: both read apart from the converter.

A look is a dictionary of numbers (three each), strings and, where an input is a texture, dictionaries.
"""

from __future__ import annotations

import hashlib
from typing import Any

import numpy as np
from conftest import Converted
from expected_stage import Part
from pxr import Ar, Sdr, Usd, UsdGeom, UsdShade

Look = dict[str, Any]
# The plugin's defaults (`resolvent plugin info principled`) of what UsdPreviewSurface sets.
PRINCIPLED = {"base_color": 0.8, "metallic": 0.0, "roughness": 0.5, "ior": 1.5, "transmission": 0.0, "clearcoat": 0.0}


class Unknown(Exception):
    """A material that has no counterpart, with the path that the report must name."""


class Missing(Exception):
    """A file that is not there: such a prim is an error."""


def three(x: Any) -> np.ndarray:
    array = np.asarray(x, dtype=float).reshape(-1)
    return np.repeat(array, 3) if array.size == 1 else array[:3]


def digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()


# What USD says


class Reader:
    """The look of a part by its bound material."""

    def __init__(self, part: Part, time: Usd.TimeCode) -> None:
        self.part, self.time = part, time
        self.uv: str | None = None
        self.uses_corners = False

    def look(self) -> Look:
        material, _ = UsdShade.MaterialBindingAPI(self.part.bound).ComputeBoundMaterial(UsdShade.Tokens.full)
        if not material:
            return self.display()
        shader, _, _ = material.ComputeSurfaceSource()
        if not shader:
            raise Unknown(str(material.GetPath()))
        if shader.GetShaderId() != "UsdPreviewSurface":
            raise Unknown(str(shader.GetPath()))
        return self.preview(shader)

    @staticmethod
    def plain(grey: float) -> Look:
        """UsdPreviewSurface with this diffuseColor and nothing else."""
        plain = {k: three(v) for k, v in PRINCIPLED.items()}
        return {"plugin": "principled", **plain, "base_color": three(grey), "emission": three(0.0)}

    def preview(self, shader: UsdShade.Shader) -> Look:
        """By the specification of UsdPreviewSurface, and what CONVENTIONS.md says of opacity."""

        def read(name: str) -> Any:
            return self.input(shader, name)

        specular = int(read("useSpecularWorkflow")[0]) == 1
        ior, coat, opacity = read("ior"), read("clearcoat"), read("opacity")
        threshold, mode = float(read("opacityThreshold")[0]), self.token(shader, "opacityMode")
        look: Look = {
            "plugin": "principled",
            "base_color": limited(read("diffuseColor")),
            "metallic": three(0.0) if specular else limited(read("metallic")),
            "roughness": limited(read("roughness")),
            "ior": ior,
            "clearcoat": limited(coat),
            "emission": read("emissiveColor"),
            "transmission": three(0.0),
        }
        if specular:
            look["f0"] = limited(read("specularColor"))
        if isinstance(coat, dict) or coat.max() > 0.0:
            look |= {"clearcoat_roughness": limited(read("clearcoatRoughness")), "clearcoat_ior": ior}
        if isinstance(opacity, dict) or opacity[0] != 1.0:
            if threshold > 0.0:
                look |= {"opacity": opacity, "cutoff": threshold}
            elif mode == "presence" or isinstance(opacity, dict):
                look["opacity"] = opacity
            else:
                look |= {"transmission": 1.0 - opacity, "transmission_color": three(1.0)}
        return look

    def display(self) -> Look:
        """displayColor and displayOpacity, of which UsdGeom says that they are for lack of a material."""
        color, opacity = (self.primvar(n, f) for n, f in (("displayColor", 0.18), ("displayOpacity", 1.0)))
        if self.part.prim.GetTypeName() == "Mesh" and (len(color) > 1 or len(opacity) > 1):
            self.uses_corners = True
            look: Look = {"plugin": "diffuse", "reflectance": {"corners": "rgb"}, "emission": three(0.0)}
            return look | ({"opacity": {"corners": "a"}} if opacity.min() < 1.0 else {})
        look = {"plugin": "diffuse", "reflectance": limited(three(color.mean(axis=0))), "emission": three(0.0)}
        return look | ({"opacity": limited(three(opacity.mean(axis=0)))} if opacity.mean() < 1.0 else {})

    def corner_colors(self) -> np.ndarray:
        """RGB and opacity at the part's corners."""
        corners = [self.at_corners("displayColor", 0.18, 3), self.at_corners("displayOpacity", 1.0, 1)]
        return np.clip(np.concatenate(corners, axis=1), 0.0, 1.0)

    def at_corners(self, name: str, fallback: float, width: int) -> np.ndarray:
        primvar = UsdGeom.PrimvarsAPI(self.part.prim).FindPrimvarWithInheritance(name)
        values = primvar.ComputeFlattened(self.time) if primvar else None
        corners = self.part.corners
        if values is None:
            return np.full((len(corners), width), fallback)
        mesh = UsdGeom.Mesh(self.part.prim)
        counts = np.array(mesh.GetFaceVertexCountsAttr().Get(self.time))
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get(self.time))
        at = {
            "constant": np.zeros(len(indices), dtype=int), "uniform": np.repeat(np.arange(len(counts)), counts),
            "vertex": indices, "varying": indices, "faceVarying": np.arange(len(indices)),
        }[primvar.GetInterpolation()]  # fmt: skip
        array = np.array(values, dtype=float).reshape(len(values), -1)
        return array[np.minimum(at, len(array) - 1) if len(array) == 1 else at][corners]

    def primvar(self, name: str, fallback: float) -> np.ndarray:
        primvar = UsdGeom.PrimvarsAPI(self.part.prim).FindPrimvarWithInheritance(name)
        values = primvar.ComputeFlattened(self.time) if primvar else None
        if values is None or len(values) == 0:
            return three(fallback)[None]
        array = np.array(values, dtype=float).reshape(len(values), -1)
        return np.unique(array, axis=0) if np.ptp(array, axis=0).max() == 0.0 else array

    # Inputs of shaders

    def token(self, shader: UsdShade.Shader, name: str) -> str:
        value = self.constant(shader, name)
        return str(default_of(shader, name) if value is None else value)

    def constant(self, shader: UsdShade.Shader, name: str) -> Any:
        """A value that no shader computes, or None."""
        found = shader.GetInput(name)
        for attribute in found.GetValueProducingAttributes() if found else []:
            if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Input:
                return attribute.Get(self.time)
        return None

    def source(self, shader: UsdShade.Shader, name: str) -> tuple[UsdShade.Shader, str] | None:
        """The shader that computes an input, and its output."""
        found = shader.GetInput(name)
        for attribute in found.GetValueProducingAttributes() if found else []:
            if UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
                return UsdShade.Shader(attribute.GetPrim()), UsdShade.Output(attribute).GetBaseName()
        return None

    def input(self, shader: UsdShade.Shader, name: str) -> Any:
        source = self.source(shader, name)
        if source is None:
            value = self.constant(shader, name)
            return three(default_of(shader, name) if value is None else value)
        inner, output = source
        kind = inner.GetShaderId()
        if kind == "UsdUVTexture":
            return self.texture(inner, output)
        assert kind.startswith("UsdPrimvarReader_"), f"no stage has {kind} at inputs:{name}"
        varname = str(self.constant(inner, "varname"))
        primvar = UsdGeom.PrimvarsAPI(self.part.prim).FindPrimvarWithInheritance(varname)
        value = primvar.ComputeFlattened(self.time) if primvar else None
        if value is None:
            return three(self.constant(inner, "fallback") or 0.0)
        if varname == "displayColor" and self.part.prim.GetTypeName() == "Mesh" and np.ptp(np.array(value), axis=0).max() > 0.0:
            self.uses_corners = True
            return {"corners": "rgb"}
        return three(np.array(value, dtype=float).reshape(-1, 3 if kind.endswith("float3") else 1).mean(axis=0))

    def texture(self, shader: UsdShade.Shader, output: str) -> Look:
        file = self.constant(shader, "file")
        if not file.resolvedPath:
            raise Missing(str(shader.GetPath()))
        asset = Ar.GetResolver().OpenAsset(Ar.ResolvedPath(file.resolvedPath))
        with asset:
            content = bytes(asset.GetBuffer())
        pick = [0, 1, 2] if output == "rgb" else ["rgba".index(output)] * 3
        wraps = [self.token(shader, n) for n in ("wrapS", "wrapT")]
        return {
            "file": digest(content),
            "color_space": self.token(shader, "sourceColorSpace"),
            # Without metadata in the file it is black.
            "wrap": "/".join("black" if w == "useMetadata" else w for w in wraps),
            "channel": output,
            "scale": self.four(shader, "scale")[pick],
            "bias": self.four(shader, "bias")[pick],
            "place": self.place(shader),
        }

    def four(self, shader: UsdShade.Shader, name: str) -> np.ndarray:
        value = self.constant(shader, name)
        return np.array(default_of(shader, name) if value is None else value, dtype=float)

    def place(self, shader: UsdShade.Shader) -> np.ndarray:
        """Texture coordinates of the primvar to those that the texture is read at: 2×3."""
        out = np.eye(3)
        source = self.source(shader, "st")
        while source is not None and source[0].GetShaderId() == "UsdTransform2d":
            node = source[0]
            scale, move = (np.array(self.pair(node, n), dtype=float) for n in ("scale", "translation"))
            angle = np.radians(float(self.pair(node, "rotation")))
            c, s = np.cos(angle), np.sin(angle)
            inner = np.eye(3)
            # "result = in * scale * rotate + translation"
            inner[:2, :2] = np.array([[c, -s], [s, c]]) @ np.diag(scale)
            inner[:2, 2] = move
            out = out @ inner
            source = self.source(node, "in")
        if source is not None:
            assert source[0].GetShaderId() == "UsdPrimvarReader_float2"
            self.uv = str(self.constant(source[0], "varname"))
        return out[:2]

    def pair(self, shader: UsdShade.Shader, name: str) -> Any:
        value = self.constant(shader, name)
        return default_of(shader, name) if value is None else value


def default_of(shader: UsdShade.Shader, name: str) -> Any:
    """By the shader's definition in usd-core's registry."""
    node = Sdr.Registry().GetShaderNodeByIdentifier(shader.GetShaderId())
    return node.GetShaderInput(name).GetDefaultValue()


def limited(value: Any) -> Any:
    return value if isinstance(value, dict) else np.clip(value, 0.0, 1.0)


# What the scene says


def found_look(converted: Converted, shape: Look) -> Look:
    """The same of a shape."""
    textures = converted.scene.get("textures", {})

    def value(x: Any) -> Any:
        if not isinstance(x, dict):
            return three(x)
        t = textures[x["texture"]]
        if t.get("vertex_color"):
            return {"corners": t.get("channel", "rgb")}
        uv = t.get("uv_transform", {})
        angle = np.radians(uv.get("rotation_deg", 0.0))
        c, s = np.cos(angle), np.sin(angle)
        linear = np.array([[c, -s], [s, c]]) @ np.diag(uv.get("scale", [1.0, 1.0]))
        return {
            "file": digest(converted.path(t["file"]).read_bytes()),
            "color_space": {"srgb": "sRGB"}.get(t.get("color_space", "auto"), t.get("color_space", "auto")),
            "wrap": f"{t['wrap_u']}/{t['wrap_v']}",
            "channel": t.get("channel", "rgb"),
            "scale": three(t.get("scale", 1.0)),
            "bias": three(t.get("bias", 0.0)),
            "place": np.column_stack([linear, uv.get("offset", [0.0, 0.0])]),
        }

    block = converted.scene["materials"][shape["material"]]
    look: Look = {}
    if block["plugin"] == "mask":
        look["opacity"] = value(block["params"]["opacity"])
        if "cutoff" in block["params"]:
            look["cutoff"] = block["params"]["cutoff"]
        block = block["params"]["bsdf"]
    defaults = PRINCIPLED if block["plugin"] == "principled" else {}
    look |= {"plugin": block["plugin"], **{k: value(v) for k, v in {**defaults, **block["params"]}.items()}}
    look["emission"] = three(shape.get("emission", 0.0))
    if "emission_texture" in shape:
        look["emission"] = value({"texture": shape["emission_texture"]})
    if "normal_map" in block:
        look["normal"] = value(block["normal_map"])
    return look


def differences(found: Any, expected: Any, at: str = "") -> list[str]:
    """Where two looks differ by more than 1e-6 (of 1, or of larger numbers)."""
    if isinstance(found, dict) and isinstance(expected, dict):
        out = [f"{at}{k}: only {'found' if k in found else 'expected'}" for k in sorted(set(found) ^ set(expected))]
        return out + [d for k in sorted(set(found) & set(expected)) for d in differences(found[k], expected[k], f"{at}{k}.")]
    if isinstance(found, str) or isinstance(expected, str):
        same = isinstance(found, str) and isinstance(expected, str) and found == expected
    elif isinstance(found, dict) or isinstance(expected, dict):
        same = False
    else:
        a, b = np.asarray(found, dtype=float), np.asarray(expected, dtype=float)
        same = a.shape == b.shape and bool((np.abs(a - b) <= 1e-6 * np.maximum(1.0, np.abs(b))).all())
    return [] if same else [f"{at.rstrip('.')}: {found} instead of {expected}"]
