"""Materials: ``principled`` as UsdPreviewSurface, ``diffuse`` as displayColor."""

from __future__ import annotations

from typing import Any

import numpy as np
from pxr import Gf, Sdf, UsdGeom, UsdShade

from ..scene import Json
from .stage import Target, color

_INPUTS = {
    "base_color": ("diffuseColor", True, 0.8),
    "metallic": ("metallic", False, 0.0),
    "roughness": ("roughness", False, 0.5),
    "ior": ("ior", False, 1.5),
    "f0": ("specularColor", True, None),
    "clearcoat": ("clearcoat", False, 0.0),
    "clearcoat_roughness": ("clearcoatRoughness", False, 0.0),
}
_WRAPS = {"repeat": "repeat", "clamp": "clamp", "mirror": "mirror", "black": "black"}


class Looks:
    """Gives prims their materials, each written once for each emission."""

    def __init__(self, target: Target) -> None:
        self.target = target
        self._written: dict[str, UsdShade.Material] = {}

    def bind(self, gprim: UsdGeom.Gprim, shape: Json) -> None:
        """The look of a shape, emission included."""
        name = shape.get("material")
        block = self.target.scene.get("materials", {}).get(name) if name is not None else None
        emission = shape.get("emission")
        if block is None:
            gprim.CreateDisplayColorAttr([Gf.Vec3f(0, 0, 0)])
            if emission is None and shape.get("type") != "gltf":
                self.target.report.skipped(str(gprim.GetPath()), "material", "a shape without material", "it is black")
                return
            block = {"plugin": "diffuse", "params": {"reflectance": 0.0}}
        if block.get("plugin") == "diffuse" and emission is None and "normal_map" not in block:
            value = block.get("params", {}).get("reflectance", 0.5)
            if not isinstance(value, dict):
                gprim.CreateDisplayColorAttr([color(value)])
                return
        key = repr((name, emission, shape.get("emission_texture")))
        if key not in self._written:
            self._written[key] = self._material(name or "black", block, shape)
        UsdShade.MaterialBindingAPI.Apply(gprim.GetPrim()).Bind(self._written[key])

    def _material(self, name: str, block: Json, shape: Json) -> UsdShade.Material:
        where = f"/materials/{name}"
        path = self.target.path(name)
        material = UsdShade.Material.Define(self.target.stage, path)
        shader = UsdShade.Shader.Define(self.target.stage, path.AppendChild("surface"))
        shader.CreateIdAttr("UsdPreviewSurface")
        material.CreateSurfaceOutput().ConnectToSource(shader.CreateOutput("surface", Sdf.ValueTypeNames.Token))
        emission = shape.get("emission")
        if emission is not None:
            self._input(material, shader, "emissiveColor", True, emission, shape.get("emission_texture"))
        inner = block
        if block.get("plugin") == "mask":
            params = block.get("params", {})
            inner = params.get("bsdf", {})
            self._set(material, shader, "opacity", False, params.get("opacity", 1.0))
            if "cutoff" in params:
                shader.CreateInput("opacityThreshold", Sdf.ValueTypeNames.Float).Set(float(params["cutoff"]))
            else:
                shader.CreateInput("opacityMode", Sdf.ValueTypeNames.Token).Set("presence")
        if (normal := block.get("normal_map")) is not None:
            self._normal(material, shader, where, normal)
        if inner.get("plugin") == "principled":
            self._principled(material, shader, where, inner.get("params", {}))
        else:
            if inner.get("plugin") == "diffuse":
                self._set(material, shader, "diffuseColor", True, inner.get("params", {}).get("reflectance", 0.5))
                shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(1)
                shader.CreateInput("specularColor", Sdf.ValueTypeNames.Color3f).Set(Gf.Vec3f(0, 0, 0))
                shader.CreateInput("roughness", Sdf.ValueTypeNames.Float).Set(1.0)
                if emission is None or np.any(np.asarray(inner.get("params", {}).get("reflectance", 0.5), dtype=object) != 0.0):
                    self.target.report.approximated(where, "diffuse", "UsdPreviewSurface always reflects a little at grazing angles", "as it does")
            else:
                self.target.report.approximated(
                    where, str(inner.get("plugin")), "UsdPreviewSurface is all that is written", "a grey surface"
                )
        return material

    def _principled(self, material: UsdShade.Material, shader: UsdShade.Shader, where: str, params: Json) -> None:
        known = set(_INPUTS) | {"transmission", "transmission_color", "clearcoat_ior"}
        for key in sorted(set(params) - known):
            self.target.report.skipped(where, key, "UsdPreviewSurface has nothing like it", "no effect in the stage")
        for key, (name, is_color, default) in _INPUTS.items():
            value = params.get(key, default)
            if value is not None:
                self._set(material, shader, name, is_color, value)
        if "f0" in params:
            shader.CreateInput("useSpecularWorkflow", Sdf.ValueTypeNames.Int).Set(1)
        transmission = params.get("transmission", 0.0)
        if isinstance(transmission, dict):
            self.target.report.skipped(where, "transmission", "as a texture it has no counterpart", "the surface is opaque")
        elif transmission > 0.0:
            shader.CreateInput("opacity", Sdf.ValueTypeNames.Float).Set(1.0 - float(transmission))
            if not np.allclose(np.asarray(color(params.get("transmission_color", params.get("base_color", 0.8)))), 1.0):
                self.target.report.approximated(where, "transmission_color", "UsdPreviewSurface's glass has no colour", "it is clear")

    def _set(self, material: UsdShade.Material, shader: UsdShade.Shader, name: str, is_color: bool, value: Any) -> None:
        """A constant or a texture."""
        texture = value.get("texture") if isinstance(value, dict) else None
        self._input(material, shader, name, is_color, 1.0 if texture is not None else value, texture)

    def _input(
        self, material: UsdShade.Material, shader: UsdShade.Shader, name: str, is_color: bool, value: Any, texture: str | None
    ) -> None:
        kind = Sdf.ValueTypeNames.Color3f if is_color else Sdf.ValueTypeNames.Float
        found = shader.CreateInput(name, kind)
        if texture is None:
            found.Set(color(value) if is_color else float(np.asarray(value, dtype=float).reshape(-1)[0]))
            return
        image = self._texture(material, name, texture, np.array(color(value)))
        channel = self.target.scene["textures"][texture].get("channel")
        output = channel or ("rgb" if is_color else "r")
        found.ConnectToSource(image.CreateOutput(output, Sdf.ValueTypeNames.Float3 if output == "rgb" else Sdf.ValueTypeNames.Float))

    def _normal(self, material: UsdShade.Material, shader: UsdShade.Shader, where: str, normal: Json) -> None:
        if float(normal.get("scale", 1.0)) != 1.0:
            self.target.report.skipped(where, "normal_map scale", "UsdPreviewSurface has nothing like it", "normals turn by what the texture says")
        image = self._texture(material, "normal", normal["texture"], np.ones(3), signed=True)
        shader.CreateInput("normal", Sdf.ValueTypeNames.Normal3f).ConnectToSource(image.CreateOutput("rgb", Sdf.ValueTypeNames.Float3))

    def _texture(self, material: UsdShade.Material, use: str, name: str, factor: Any, signed: bool = False) -> UsdShade.Shader:
        t = self.target.scene["textures"][name]
        image = UsdShade.Shader.Define(self.target.stage, material.GetPath().AppendChild(f"{use}_texture"))
        image.CreateIdAttr("UsdUVTexture")
        if t.get("vertex_color"):
            self.target.report.skipped(f"/textures/{name}", "vertex_color", "colours at corners are not written", "the mesh is without them")
        if "file" in t:
            image.CreateInput("file", Sdf.ValueTypeNames.Asset).Set(self.target.asset(t["file"]))
        elif "data" in t:
            self.target.report.skipped(f"/textures/{name}", "data", "images inside scenes are not written", "the texture is black")
        space = {"srgb": "sRGB", "raw": "raw", "linear": "raw"}.get(t.get("color_space", "auto"), "auto")
        image.CreateInput("sourceColorSpace", Sdf.ValueTypeNames.Token).Set(space)
        for axis, key in (("S", "wrap_u"), ("T", "wrap_v")):
            image.CreateInput(f"wrap{axis}", Sdf.ValueTypeNames.Token).Set(_WRAPS[t.get(key, t.get("wrap", "repeat"))])
        scale, bias = np.array(color(t.get("scale", 1.0))) * factor, np.array(color(t.get("bias", 0.0))) * factor
        if signed:
            scale, bias = 2.0 * scale, 2.0 * bias - 1.0
        image.CreateInput("scale", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*map(float, scale), 1.0))
        image.CreateInput("bias", Sdf.ValueTypeNames.Float4).Set(Gf.Vec4f(*map(float, bias), 0.0))
        reader = UsdShade.Shader.Define(self.target.stage, material.GetPath().AppendChild("st"))
        reader.CreateIdAttr("UsdPrimvarReader_float2")
        reader.CreateInput("varname", Sdf.ValueTypeNames.String).Set("st")
        source = reader.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        if (uv := t.get("uv_transform")) is not None:
            moved = UsdShade.Shader.Define(self.target.stage, material.GetPath().AppendChild(f"{use}_st"))
            moved.CreateIdAttr("UsdTransform2d")
            moved.CreateInput("in", Sdf.ValueTypeNames.Float2).ConnectToSource(source)
            moved.CreateInput("scale", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*map(float, uv.get("scale", (1.0, 1.0)))))
            moved.CreateInput("rotation", Sdf.ValueTypeNames.Float).Set(float(uv.get("rotation_deg", 0.0)))
            moved.CreateInput("translation", Sdf.ValueTypeNames.Float2).Set(Gf.Vec2f(*map(float, uv.get("offset", (0.0, 0.0)))))
            source = moved.CreateOutput("result", Sdf.ValueTypeNames.Float2)
        image.CreateInput("st", Sdf.ValueTypeNames.Float2).ConnectToSource(source)
        return image
