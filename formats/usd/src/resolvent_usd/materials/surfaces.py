"""Surface shaders as the ``principled`` BSDF: UsdPreviewSurface, MaterialX's standard_surface and OpenPBR.

What has no counterpart there is reported where it is authored with an effect.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
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

    def read_normal(self, name: str, of: str = "normal") -> Json | None:
        """A texture of normals, and the factor on their slope if it is not 1."""
        link = self.node.link(name)
        if link is None:
            value = self.node.value(name)
            if value is not None and not np.allclose(np.asarray(value, dtype=float), _NORMAL_UP):
                self.node.claim.skipped(f"inputs:{name}", "a constant normal is not there", "the surface's own normals are used")
            return None
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
            return None
        texture = {"color_space": "raw", **value.texture}
        if texture["color_space"] == "srgb":
            self.node.claim.approximated(f"inputs:{name}", "the normals are said to be sRGB colours", "they are read so")
        value = Value(value.constant, texture, value.scale, value.bias)
        found: Json = {"texture": self.builder.texture(f"{self.name} {of}", value)}
        if scale != 1.0:
            found["scale"] = scale
        return found

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
    s.normal = s.read_normal("normal")
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


@dataclass(frozen=True)
class _Names:
    """What a layered shader calls the inputs that standard_surface and OpenPBR have both, and its defaults where theirs differ."""

    base: str
    metalness: str
    specular: str
    diffuse_roughness: str
    roughness: float
    ior: str
    anisotropy: str
    transmission: str
    depth: tuple[str, ...]
    """Of the inside of what transmits; without effect at 0."""
    inside: tuple[str, ...]
    """What only matters with them."""
    subsurface: str
    subsurface_rest: tuple[str, ...]
    sheen: str
    sheen_color: str
    sheen_roughness: tuple[str, float]
    coat: str
    coat_roughness: float
    coat_ior: tuple[str, float]
    coat_darkening: str | None
    coat_uneven: dict[str, Any]
    """Of the coat's shape, with the values that make it even."""
    coat_rest: tuple[str, ...]
    coat_normal: str
    film: str | None
    """Its weight; None where its thickness alone says whether there is one."""
    film_thickness: tuple[str, float, float]
    """With its default and its unit in nanometres."""
    film_ior: tuple[str, float]
    tangents: dict[str, Any]
    thin: str
    opacity: str
    emission: str
    normal: str


_X = (1.0, 0.0, 0.0)
STANDARD_SURFACE = _Names(
    base="base", metalness="metalness", specular="specular", diffuse_roughness="diffuse_roughness", roughness=0.2, ior="specular_IOR",
    anisotropy="specular_anisotropy", transmission="transmission",
    depth=("transmission_depth", "transmission_scatter", "transmission_dispersion", "transmission_extra_roughness"),
    inside=("transmission_scatter_anisotropy",), subsurface="subsurface",
    subsurface_rest=("subsurface_color", "subsurface_radius", "subsurface_scale", "subsurface_anisotropy"),
    sheen="sheen", sheen_color="sheen_color", sheen_roughness=("sheen_roughness", 0.3),
    coat="coat", coat_roughness=0.1, coat_ior=("coat_IOR", 1.5), coat_darkening=None,
    coat_uneven={"coat_anisotropy": 0.0, "coat_affect_color": 0.0, "coat_affect_roughness": 0.0},
    coat_rest=("coat_rotation",), coat_normal="coat_normal", film=None, film_thickness=("thin_film_thickness", 0.0, 1.0), film_ior=("thin_film_IOR", 1.5),
    tangents={"specular_rotation": 0.0, "tangent": _X},
    thin="thin_walled", opacity="opacity", emission="emission", normal="normal",
)  # fmt: skip
"""Autodesk Standard Surface 1.0.1."""

OPEN_PBR = _Names(
    base="base_weight", metalness="base_metalness", specular="specular_weight", diffuse_roughness="base_diffuse_roughness", roughness=0.3,
    ior="specular_ior", anisotropy="specular_roughness_anisotropy", transmission="transmission_weight",
    depth=("transmission_depth", "transmission_scatter", "transmission_dispersion_scale"),
    inside=("transmission_scatter_anisotropy", "transmission_dispersion_abbe_number"), subsurface="subsurface_weight",
    subsurface_rest=("subsurface_color", "subsurface_radius", "subsurface_radius_scale", "subsurface_scatter_anisotropy"),
    sheen="fuzz_weight", sheen_color="fuzz_color", sheen_roughness=("fuzz_roughness", 0.5),
    coat="coat_weight", coat_roughness=0.0, coat_ior=("coat_ior", 1.6), coat_darkening="coat_darkening",
    coat_uneven={"coat_roughness_anisotropy": 0.0},
    coat_rest=(), coat_normal="geometry_coat_normal", film="thin_film_weight", film_thickness=("thin_film_thickness", 0.5, 1e3), film_ior=("thin_film_ior", 1.4),
    tangents={"geometry_tangent": _X, "geometry_coat_tangent": _X},
    # A luminance in nits; 1 shows as 1, as with lights.
    thin="geometry_thin_walled", opacity="geometry_opacity", emission="emission_luminance", normal="geometry_normal",
)  # fmt: skip
"""OpenPBR Surface 1.1."""


def _layered(s: _Surface, names: _Names) -> Look:
    s.set("base_color", s.product(names.base, "base_color", 1.0, 0.8), number=False)
    _reflection(s, names.metalness, names.specular)
    roughness = s.read(names.diffuse_roughness, 0.0)
    s.set("diffuse_roughness", roughness, 0.0)
    if names is STANDARD_SURFACE and not roughness.is_just(0.0):
        s.node.claim.approximated(f"inputs:{names.diffuse_roughness}", "principled has OpenPBR's rough diffuse", "not Oren and Nayar's")
    s.set("roughness", s.read("specular_roughness", names.roughness), 0.5)
    s.set("ior", _constant(s, names.ior, 1.5), 1.5, 1.0, 5.0)
    s.set("anisotropy", s.read(names.anisotropy, 0.0), 0.0)
    _transmission(s, names)
    _subsurface(s, names.subsurface, names.subsurface_rest)
    _sheen(s, names)
    _coat(s, names)
    _film(s, names)
    s.without(names.tangents, "highlights stretch across x")
    if bool(s.node.value(names.thin, False)):
        s.params["thin"] = True
    s.opacity = s.read(names.opacity, 1.0)
    s.emission = s.product(names.emission, "emission_color", 0.0, 1.0)
    s.normal = s.read_normal(names.normal)
    _coat_normal(s, names)
    return s.look()


def _transmission(s: _Surface, names: _Names) -> None:
    transmission = s.read(names.transmission, 0.0)
    s.set("transmission", transmission, 0.0)
    s.ignore(*names.inside)
    if transmission.is_just(0.0):
        s.ignore("transmission_color", *names.depth)
        return
    s.set("transmission_color", s.read("transmission_color", 1.0), None, number=False)
    s.without(dict.fromkeys(names.depth, 0.0), "the colour is met at the surface, the inside is clear")


def _sheen(s: _Surface, names: _Names) -> None:
    sheen = s.read(names.sheen, 0.0)
    s.set("sheen", sheen, 0.0)
    if sheen.is_just(0.0):
        s.ignore(names.sheen_color, names.sheen_roughness[0])
        return
    s.set("sheen_color", s.read(names.sheen_color, 1.0), 1.0, number=False)
    s.set("sheen_roughness", s.read(*names.sheen_roughness), 0.3)


def _film(s: _Surface, names: _Names) -> None:
    weight = Value(np.ones(3)) if names.film is None else s.read(names.film, 0.0)
    name, default, unit = names.film_thickness
    thickness = s.read(name, default).times(unit)
    if weight.is_just(0.0) or thickness.is_just(0.0):
        s.ignore(names.film_ior[0])
        return
    s.set("thin_film", weight, 0.0)
    s.set("thin_film_thickness", thickness, 500.0, 0.0, 1e9)
    s.set("thin_film_ior", _constant(s, *names.film_ior), 1.4, 1.0, 5.0)


def _coat(s: _Surface, names: _Names) -> None:
    coat = s.read(names.coat, 0.0)
    s.set("clearcoat", coat, 0.0)
    s.ignore(*names.coat_rest)
    if coat.is_just(0.0):
        s.ignore("coat_color", "coat_roughness", names.coat_ior[0], *names.coat_uneven)
        if names.coat_darkening:
            s.ignore(names.coat_darkening)
        return
    s.set("clearcoat_roughness", s.read("coat_roughness", names.coat_roughness), 0.0)
    s.set("clearcoat_ior", _constant(s, *names.coat_ior), 1.5, 1.0, 3.0)
    s.set("clearcoat_color", s.read("coat_color", 1.0), 1.0, number=False)
    if names.coat_darkening:
        s.set("clearcoat_darkening", s.read(names.coat_darkening, 1.0), 0.0)
    s.without(names.coat_uneven, "the coat is even")


def _coat_normal(s: _Surface, names: _Names) -> None:
    """The coat's normals are never the base's: a map of its own, or else the surface's."""
    if "clearcoat" not in s.params:
        s.ignore(names.coat_normal)
        return
    own = s.read_normal(names.coat_normal, "coat normal")
    if own is not None:
        s.params["clearcoat_normal"] = {"texture": own["texture"]}
        if "scale" in own:
            s.params["clearcoat_normal_scale"] = own["scale"]
    elif s.normal is not None:
        s.params["clearcoat_normal"] = [0.5, 0.5, 1.0]


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
    "standard_surface": partial(_layered, names=STANDARD_SURFACE),
    "open_pbr_surface": partial(_layered, names=OPEN_PBR),
}
