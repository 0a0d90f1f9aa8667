"""Surface shaders as the ``principled`` BSDF: UsdPreviewSurface, MaterialX's standard_surface and OpenPBR.

What has no counterpart there is reported where it is authored with an effect.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np

from ..context import Look
from ..scene import Json, rgb
from ..shading import Node
from .values import Builder, Value, kind_of

_NORMAL_UP = (0.0, 0.0, 1.0)


def convert(builder: Builder, node: Node, name: str) -> Look | None:
    """A material of the scene; None, and reported, for a shader that is unknown."""
    make = _SHADERS.get(_kind(node))
    if make is None:
        node.claim.skipped(
            "info:id",
            f"the surface shader {node.described} is unknown (known: {', '.join(_SHADERS)})",
            "surfaces look as if no material were bound",
        )
        return None
    return make(_Surface(builder, node, name))


def _kind(node: Node) -> str:
    name = node.id
    if name.startswith("ND_"):
        name = name[3:].removesuffix("_surfaceshader")
    return name.split(":")[-1]


class _Surface:
    """One material in the making."""

    def __init__(self, builder: Builder, node: Node, name: str) -> None:
        self.builder = builder
        self.node = node
        self.name = name
        self.params: Json = {}
        self.opacity: Value | None = None
        self.cutoff: float | None = None
        self.emission: Value | None = None
        self.normal: Json | None = None

    def read(self, name: str, default: Any) -> Value:
        return self.builder.read(self.node, name, default)

    def set(self, key: str, value: Value, plain: Any = None, low: float = 0.0, high: float = 1.0, number: bool = True) -> None:
        """Sets a parameter, unless it is what the plugin has anyway."""
        if plain is not None and value.is_just(plain):
            return
        if value.is_constant and (value.constant.min() < low - 1e-6 or value.constant.max() > high + 1e-6):
            self.node.claim.approximated(
                f"inputs:{key}", f"{rgb(value.constant)} is not between {low:g} and {high:g}", "it is limited to that"
            )
        self.params[key] = self.builder.parameter(f"{self.name} {key}", value, low, high, number)

    def without(self, names: dict[str, Any], consequence: str) -> None:
        """Reports inputs that have no counterpart, where they differ from a value without effect."""
        for name, plain in names.items():
            if self.node.connected(name):
                self.node.claim.skipped(f"inputs:{name}", "principled has nothing like it", consequence)
                continue
            value = self.node.value(name)
            if value is not None and not isinstance(value, str) and not np.allclose(np.asarray(value, dtype=float), plain):
                self.node.claim.skipped(f"inputs:{name}", "principled has nothing like it", consequence)

    def ignore(self, *names: str) -> None:
        """Inputs that mean nothing since what they shape is off."""
        self.node.claim.take(*(f"inputs:{n}" for n in names))

    def product(self, weight: str, color: str, weight_default: float, color_default: Any) -> Value:
        """A weight times a colour, of which one may be a texture."""
        w, c = self.read(weight, weight_default), self.read(color, color_default)
        if w.is_constant:
            return c.times(w.constant)
        if c.is_constant:
            return w.times(c.constant)
        self.node.claim.approximated(f"inputs:{weight}", f"it and {color} are both textures", "its mean is not known: taken as 1")
        return c

    def read_normal(self, name: str) -> None:
        """A texture of normals."""
        link = self.node.link(name)
        if link is None:
            value = self.node.value(name)
            if value is not None and not np.allclose(np.asarray(value, dtype=float), _NORMAL_UP):
                self.node.claim.skipped(f"inputs:{name}", "a constant normal is not there", "the surface's own normals are used")
            return
        inner = link.node
        scale = 1.0
        if kind_of(inner) == "normalmap":
            factor = self.builder.read(inner, "scale", 1.0)
            scale = factor.number
            inner.claim.take("inputs:normal", "inputs:tangent", "inputs:bitangent", "inputs:space")
            value = self.builder.read(inner, "in", (0.5, 0.5, 1.0))
        else:
            # UsdPreviewSurface reads components in −1..1; the scene's normal maps are textures in 0..1.
            value = self.builder.read(self.node, name, _NORMAL_UP).plus(1.0).times(0.5)
        if value.texture is None:
            self.node.claim.skipped(f"inputs:{name}", f"{inner.described} gives no texture of normals", "the surface's own are used")
            return
        texture = {"color_space": "raw", **value.texture}
        if texture["color_space"] == "srgb":
            self.node.claim.approximated(f"inputs:{name}", "the normals are said to be sRGB colours", "they are read so")
        value = Value(value.constant, texture, value.scale, value.bias)
        self.normal = {"texture": self.builder.texture(f"{self.name} normal", value)}
        if scale != 1.0:
            self.normal["scale"] = scale

    def look(self) -> Look:
        block: Json = {"plugin": "principled", "params": self.params}
        if self.opacity is not None and not self.opacity.is_just(1.0):
            params: Json = {"bsdf": block, "opacity": self.builder.parameter(f"{self.name} opacity", self.opacity, 0.0, 1.0, True)}
            if self.cutoff is not None:
                params["cutoff"] = self.cutoff
            block = {"plugin": "mask", "params": params}
        if self.normal is not None:
            block = {**block, "normal_map": self.normal}
        shape: Json = {"material": self.builder.ctx.scene.material(self.name, block)}
        if self.emission is not None:
            shape |= emission(self.builder, self.name, self.emission)
        return Look(shape, self.builder.uv, colors=self.builder.colors)


def emission(builder: Builder, name: str, value: Value) -> Json:
    """Keys of a shape that emits; none if it is dark."""
    if value.texture is None:
        color = np.maximum(value.constant, 0.0)
        return {"emission": rgb(color)} if color.max() > 0.0 else {}
    scale = np.ones(3) if value.scale is None else value.scale
    if scale.max() <= 0.0 and value.bias is None:
        return {}
    return {"emission": [1.0, 1.0, 1.0], "emission_texture": builder.texture(f"{name} emission", value)}


def _preview(s: _Surface) -> Look:
    """UsdPreviewSurface 2.6: GGX with α = roughness², in both workflows."""
    ior = s.read("ior", 1.5)
    index = ior.number if ior.is_constant else 1.5
    if not ior.is_constant:
        s.node.claim.approximated("inputs:ior", "an index of refraction can't be a texture", "it is taken as 1.5")
    s.set("base_color", s.read("diffuseColor", 0.18), low=0.0, high=1.0, number=False)
    s.set("roughness", s.read("roughness", 0.5), 0.5)
    s.set("ior", Value(np.repeat(index, 3)), 1.5, 1.0, 5.0)
    if int(s.read("useSpecularWorkflow", 0.0).number):
        s.set("f0", s.read("specularColor", 0.0), number=False)
        s.ignore("metallic")
    else:
        s.set("metallic", s.read("metallic", 0.0), 0.0)
        s.ignore("specularColor")
    coat = s.read("clearcoat", 0.0)
    s.set("clearcoat", coat, 0.0)
    coat_roughness = s.read("clearcoatRoughness", 0.01)
    if not coat.is_just(0.0):
        s.set("clearcoat_roughness", coat_roughness, 0.0)
        s.set("clearcoat_ior", Value(np.repeat(index, 3)), 1.5, 1.0, 3.0)
    _preview_opacity(s)
    s.emission = s.read("emissiveColor", 0.0)
    s.read_normal("normal")
    s.without({"displacement": 0.0}, "the surface is smooth")
    if s.node.connected("occlusion") or not s.read("occlusion", 1.0).is_just(1.0):
        s.node.claim.skipped("inputs:occlusion", "light finds its own way into corners", "no effect")
    return s.look()


def _preview_opacity(s: _Surface) -> None:
    opacity = s.read("opacity", 1.0)
    threshold = s.read("opacityThreshold", 0.0).number
    mode = str(s.node.value("opacityMode", "transparent"))
    if opacity.is_just(1.0):
        return
    if threshold > 0.0:
        s.opacity, s.cutoff = opacity, min(threshold, 1.0)
    elif mode == "presence":
        s.opacity = opacity
    elif opacity.is_constant:
        # Even where it is transparent, it reflects: glass with the shader's index of refraction.
        s.set("transmission", Value(1.0 - np.clip(opacity.constant, 0.0, 1.0)))
        s.params["transmission_color"] = 1.0
    else:
        s.opacity = opacity
        s.node.claim.approximated(
            "inputs:opacity", "a texture of opacity in the mode 'transparent'", "where it is transparent the surface is not there, and does not reflect"
        )


def _standard_surface(s: _Surface) -> Look:
    """Autodesk Standard Surface 1.0.1."""
    s.set("base_color", s.product("base", "base_color", 1.0, 0.8), number=False)
    _reflection(s, "metalness", "specular")
    roughness = s.read("diffuse_roughness", 0.0)
    s.set("diffuse_roughness", roughness, 0.0)
    if not roughness.is_just(0.0):
        s.node.claim.approximated("inputs:diffuse_roughness", "principled has OpenPBR's rough diffuse", "not Oren and Nayar's")
    s.set("roughness", s.read("specular_roughness", 0.2), 0.5)
    s.set("ior", _constant(s, "specular_IOR", 1.5), 1.5, 1.0, 5.0)
    s.set("anisotropy", s.read("specular_anisotropy", 0.0), 0.0)
    transmission = s.read("transmission", 0.0)
    s.set("transmission", transmission, 0.0)
    if not transmission.is_just(0.0):
        s.set("transmission_color", s.read("transmission_color", 1.0), None, number=False)
        s.without(
            {"transmission_depth": 0.0, "transmission_scatter": 0.0, "transmission_dispersion": 0.0, "transmission_extra_roughness": 0.0},
            "the colour is met at the surface, the inside is clear",
        )
        s.ignore("transmission_scatter_anisotropy")
    else:
        s.ignore("transmission_color", "transmission_depth", "transmission_scatter", "transmission_scatter_anisotropy")
        s.ignore("transmission_dispersion", "transmission_extra_roughness")
    _subsurface(s, "subsurface", ("subsurface_color", "subsurface_radius", "subsurface_scale", "subsurface_anisotropy"))
    sheen = s.read("sheen", 0.0)
    s.set("sheen", sheen, 0.0)
    if not sheen.is_just(0.0):
        s.set("sheen_color", s.read("sheen_color", 1.0), 1.0, number=False)
        s.set("sheen_roughness", s.read("sheen_roughness", 0.3), 0.3)
    else:
        s.ignore("sheen_color", "sheen_roughness")
    coat = s.read("coat", 0.0)
    s.set("clearcoat", coat, 0.0)
    if not coat.is_just(0.0):
        s.set("clearcoat_roughness", s.read("coat_roughness", 0.1), 0.0)
        s.set("clearcoat_ior", _constant(s, "coat_IOR", 1.5), 1.5, 1.0, 3.0)
        s.set("clearcoat_color", s.read("coat_color", 1.0), 1.0, number=False)
        s.without(
            {"coat_anisotropy": 0.0, "coat_affect_color": 0.0, "coat_affect_roughness": 0.0, "coat_normal": _NORMAL_UP},
            "the coat is even",
        )
        s.ignore("coat_rotation")
    else:
        s.ignore("coat_color", "coat_roughness", "coat_IOR", "coat_anisotropy", "coat_rotation", "coat_normal")
        s.ignore("coat_affect_color", "coat_affect_roughness")
    s.without({"thin_film_thickness": 0.0}, "the surface does not iridesce")
    s.without({"specular_rotation": 0.0, "tangent": (1.0, 0.0, 0.0)}, "highlights stretch across x")
    s.ignore("thin_film_IOR")
    if bool(s.node.value("thin_walled", False)):
        s.params["thin"] = True
    s.opacity = s.read("opacity", 1.0)
    s.emission = s.product("emission", "emission_color", 0.0, 1.0)
    s.read_normal("normal")
    return s.look()


def _open_pbr(s: _Surface) -> Look:
    """OpenPBR Surface 1.1."""
    s.set("base_color", s.product("base_weight", "base_color", 1.0, 0.8), number=False)
    _reflection(s, "base_metalness", "specular_weight")
    s.set("diffuse_roughness", s.read("base_diffuse_roughness", 0.0), 0.0)
    s.set("roughness", s.read("specular_roughness", 0.3), 0.5)
    s.set("ior", _constant(s, "specular_ior", 1.5), 1.5, 1.0, 5.0)
    s.set("anisotropy", s.read("specular_roughness_anisotropy", 0.0), 0.0)
    transmission = s.read("transmission_weight", 0.0)
    s.set("transmission", transmission, 0.0)
    inner = ("transmission_depth", "transmission_scatter", "transmission_dispersion_scale")
    if not transmission.is_just(0.0):
        s.set("transmission_color", s.read("transmission_color", 1.0), None, number=False)
        s.without(dict.fromkeys(inner, 0.0), "the colour is met at the surface, the inside is clear")
    else:
        s.ignore("transmission_color", *inner)
    s.ignore("transmission_scatter_anisotropy", "transmission_dispersion_abbe_number")
    names = ("subsurface_color", "subsurface_radius", "subsurface_radius_scale", "subsurface_scatter_anisotropy")
    _subsurface(s, "subsurface_weight", names)
    fuzz = s.read("fuzz_weight", 0.0)
    s.set("sheen", fuzz, 0.0)
    if not fuzz.is_just(0.0):
        s.set("sheen_color", s.read("fuzz_color", 1.0), 1.0, number=False)
        s.set("sheen_roughness", s.read("fuzz_roughness", 0.5), 0.3)
    else:
        s.ignore("fuzz_color", "fuzz_roughness")
    coat = s.read("coat_weight", 0.0)
    s.set("clearcoat", coat, 0.0)
    if not coat.is_just(0.0):
        s.set("clearcoat_roughness", s.read("coat_roughness", 0.0), 0.0)
        s.set("clearcoat_ior", _constant(s, "coat_ior", 1.6), 1.5, 1.0, 3.0)
        s.set("clearcoat_color", s.read("coat_color", 1.0), 1.0, number=False)
        s.set("clearcoat_darkening", s.read("coat_darkening", 1.0), 0.0)
        s.without({"coat_roughness_anisotropy": 0.0, "geometry_coat_normal": _NORMAL_UP}, "the coat is even")
    else:
        s.ignore("coat_color", "coat_roughness", "coat_ior", "coat_roughness_anisotropy", "coat_darkening", "geometry_coat_normal")
    s.without({"thin_film_weight": 0.0}, "the surface does not iridesce")
    s.without({"geometry_tangent": (1.0, 0.0, 0.0), "geometry_coat_tangent": (1.0, 0.0, 0.0)}, "highlights stretch across x")
    s.ignore("thin_film_thickness", "thin_film_ior")
    if bool(s.node.value("geometry_thin_walled", False)):
        s.params["thin"] = True
    s.opacity = s.read("geometry_opacity", 1.0)
    # A luminance in nits; 1 shows as 1, as with lights.
    s.emission = s.product("emission_luminance", "emission_color", 0.0, 1.0)
    s.read_normal("geometry_normal")
    return s.look()


def _reflection(s: _Surface, metalness: str, weight: str) -> None:
    """Dielectric and metal; the metal's edge, at 82°, has the specular colour."""
    metal, color = s.read(metalness, 0.0), s.read("specular_color", 1.0)
    s.set("metallic", metal, 0.0)
    s.set("specular", s.read(weight, 1.0), 1.0)
    s.set("specular_color", color, 1.0, 0.0, 1e3, number=False)
    if not metal.is_just(0.0):
        s.set("edge_color", color, 1.0, number=False)


def _constant(s: _Surface, name: str, default: float) -> Value:
    """An input that can't be a texture."""
    value = s.read(name, default)
    if value.is_constant:
        return value
    s.node.claim.approximated(f"inputs:{name}", "an index of refraction can't be a texture", f"it is taken as {default:g}")
    return Value(np.repeat(default, 3))


def _subsurface(s: _Surface, weight: str, names: tuple[str, ...]) -> None:
    """Shown as a diffuse surface of the base colour."""
    value = s.read(weight, 0.0)
    s.ignore(*names)
    if not value.is_just(0.0):
        s.node.claim.approximated(
            f"inputs:{weight}", "light below the surface is not followed", "that share of it is diffuse, in the base colour"
        )


_SHADERS: dict[str, Callable[[_Surface], Look]] = {
    "UsdPreviewSurface": _preview,
    "standard_surface": _standard_surface,
    "open_pbr_surface": _open_pbr,
}
