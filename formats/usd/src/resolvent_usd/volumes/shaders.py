"""Volume shaders of several renderers as :class:`Optics`.

* MaterialX and Karma: ``ND_volume`` (with ``ND_anisotropic_vdf``, ``ND_absorption_vdf``, ``ND_uniform_edf``), ``kma_volume``:
  absorption and scattering per length, read from fields by ``ND_geompropvalue_*`` times constants. Karma's pyro shader is a
  node graph of these.
* Arnold: ``standard_volume``: σ_t = density · −ln(transparent)/transparent_depth, albedo = scatter · scatter_color.
* Cycles and Blender: ``principled_volume``: σ_s = density · color, σ_a = density · (1 − color)(1 − √absorption_color).

Black bodies of the latter two have the luminance 10⁻⁶ σ T⁴/π; Planck's law agrees with it at one temperature, the shader's.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from ..shading import MAX_DEPTH, Node
from .optics import NOTHING, Color, Optics, Term, color, stefan_factor

CONTEXTS = ("", "mtlx", "kma", "karma", "arnold", "cycles")
"""Render contexts of volume outputs, in order of preference."""


def optics_of(node: Node) -> Optics | None:
    """What a volume shader says; None, and reported, for an unknown one."""
    name = node.id.rsplit("::", 1)[0].split(":")[-1].lower()
    name = name.removeprefix("nd_").removesuffix("_volumeshader")
    convert = _SHADERS.get(name)
    if convert is None:
        node.claim.skipped(
            "info:id",
            f"the volume shader {node.described} is unknown (known: {', '.join(_SHADERS)})",
            "the volume looks as if it had no material",
        )
        return None
    return convert(node)


def term(node: Node, name: str, default: float | Color | None, depth: int = 0) -> Term:
    """An input as a factor times fields; what cannot be followed is reported and has its default."""
    fallback = NOTHING if default is None else Term(color(default))
    link = node.link(name)
    if link is None:
        value = node.value(name)
        return fallback if value is None else Term(color(value))
    inner = link.node
    kind = inner.id.removeprefix("ND_").rsplit("_", 1)[0] if inner.id.startswith("ND_") else inner.id
    if depth < MAX_DEPTH:
        if kind.startswith(("geompropvalue", "UsdPrimvarReader")):
            varname = inner.value("geomprop") or inner.value("varname")
            inner.claim.take("inputs:default", "inputs:fallback")
            if varname:
                return Term(fields=(str(varname),))
        if kind.split("_")[0] == "multiply":
            return term(inner, "in1", 0.0, depth + 1) * term(inner, "in2", 1.0, depth + 1)
        if kind.startswith("constant"):
            return term(inner, "value", 0.0, depth + 1)
        if kind.startswith(("convert", "dot")):
            return term(inner, "in", 0.0, depth + 1)
        if kind in ("volume_sample_float", "volume_sample_rgb", "volume_sample"):
            inner.claim.take("inputs:volume_type", "inputs:interpolation")
            channel = inner.value("channel")
            if channel:
                return Term(fields=(str(channel),))
    node.claim.approximated(
        f"inputs:{name}", f"{inner.described} is connected, which can't be computed per voxel", f"it is taken as {fallback.factor.tolist()}"
    )
    return fallback


def _materialx(node: Node) -> Optics:
    """Absorption and scattering here, or behind ``vdf``; emission here, or behind ``edf``."""
    out = Optics()
    vdf = node.link("vdf")
    source = vdf.node if vdf is not None else node
    if vdf is None and node.attribute("scattering_color") is not None:
        # No shader of a standard, but written: an albedo, where the density is the extinction.
        out.extinction = Term(fields=("density",))
        out.albedo = term(node, "scattering_color", 1.0)
        absorption = term(node, "absorption_color", 0.0)
        if absorption.factor.any():
            node.claim.skipped("inputs:absorption_color", "the albedo says what is absorbed", "no effect")
    else:
        lost = out.of_coefficients(term(source, "absorption", 0.0), term(source, "scattering", 0.0))
        if lost:
            source.claim.approximated("inputs:absorption", lost, "the colour of the shadows is off")
    out.g = float(source.value("anisotropy", 0.0))
    out.g2 = float(source.value("secondary_anisotropy", 0.0))
    out.mix = float(source.value("secondary_mix", 0.0))
    edf = node.link("edf")
    if edf is not None:
        out.emission = term(edf.node, "color", 1.0)
    elif node.attribute("emission") is not None:
        out.emission = term(node, "emission", 0.0)
    return out


def _arnold(node: Node) -> Optics:
    out = Optics()
    density = term(node, "density", 1.0)
    channel = str(node.value("density_channel", "density") or "")
    if channel and not density.fields:
        density = density * Term(fields=(channel,))
    depth = max(float(node.value("transparent_depth", 1.0)), 1e-9)
    transparent = np.clip(color(node.value("transparent", (np.exp(-1.0),) * 3)), 1e-12, 1.0)
    if str(node.value("transparent_channel", "") or ""):
        node.claim.approximated("inputs:transparent_channel", "the extinction has one field, the density", "its colour is constant")
    out.extinction = density.scaled(-np.log(transparent) / depth)
    albedo = term(node, "scatter_color", 0.5).scaled(float(node.value("scatter", 1.0)))
    channel = str(node.value("scatter_color_channel", "") or "")
    if channel and not albedo.fields:
        albedo = albedo * Term(fields=(channel,))
    out.albedo = albedo
    out.g = float(node.value("scatter_anisotropy", 0.0))
    modes = ("none", "channel", "density", "blackbody")
    mode = node.value("emission_mode", "blackbody")
    mode = modes[int(mode)] if isinstance(mode, int) and 0 <= mode < 4 else str(mode)
    tint = term(node, "emission_color", 1.0).scaled(float(node.value("emission", 1.0)))
    emission_channel = str(node.value("emission_channel", "") or "")
    kelvin = float(node.value("temperature", 1.0)) * float(node.value("blackbody_kelvin", 5000.0))
    temperature_channel = str(node.value("temperature_channel", "temperature") or "")
    strength = float(node.value("blackbody_intensity", 1.0))
    if mode == "density":
        out.emission = tint * density
    elif mode == "channel" and emission_channel:
        out.emission = tint * Term(fields=(emission_channel,))
    elif mode == "blackbody" and temperature_channel:
        _blackbody(node, out, kelvin, temperature_channel, strength, tint.factor)
    for name in ("displacement", "interpolation"):
        node.claim.no_effect(f"inputs:{name}", "volumes are not displaced, and always interpolated trilinearly", "no effect")
    return out


def _cycles(node: Node) -> Optics:
    out = Optics()
    density = term(node, "density", 1.0)
    name = str(node.value("density_attribute", "density") or "")
    if name and not density.fields:
        density = density * Term(fields=(name,))
    scatter = term(node, "color", 0.5)
    name = str(node.value("color_attribute", "") or "")
    if name and not scatter.fields:
        scatter = scatter * Term(fields=(name,))
    absorbed = color(node.value("absorption_color", 0.0))
    share = scatter.factor
    if scatter.fields:
        node.claim.approximated(
            "inputs:color", "its field varies the albedo alone", "the extinction is that of the constant part of the colour"
        )
    extinction = share + np.maximum(1.0 - share, 0.0) * np.maximum(1.0 - np.sqrt(np.maximum(absorbed, 0.0)), 0.0)
    out.extinction = density.scaled(extinction)
    out.albedo = Term(np.divide(share, extinction, out=np.zeros(3), where=extinction > 0.0), scatter.fields)
    out.g = float(node.value("anisotropy", 0.0))
    out.emission = term(node, "emission_color", 1.0).scaled(float(node.value("emission_strength", 0.0)))
    strength = float(node.value("blackbody_intensity", 0.0))
    kelvin = float(node.value("temperature", 1000.0))
    field = str(node.value("temperature_attribute", "temperature") or "")
    tint = color(node.value("blackbody_tint", 1.0))
    if strength > 0.0 and field:
        _blackbody(node, out, kelvin, field, strength, tint)
    return out


def _blackbody(node: Node, out: Optics, kelvin: float, field: str, strength: float, tint: Color) -> None:
    """Kelvin per unit of a field that a black body's radiance comes from."""
    if strength <= 0.0 or kelvin <= 0.0 or not tint.any():
        return
    out.temperature = Term(np.full(3, kelvin), (field,))
    # A grid in kelvin has a factor of 1: something that glows is meant.
    reference = kelvin if kelvin >= 400.0 else 2000.0
    out.blackbody = strength * float(tint.mean()) * stefan_factor(reference)
    node.claim.approximated(
        "inputs:blackbody_intensity",
        "black bodies here follow Planck's law, in colour and in luminance, not a law of T⁴",
        f"at {reference:g} K they are as bright as the shader says, elsewhere as physics has them",
    )
    if np.ptp(tint) > 1e-6 * tint.max():
        node.claim.approximated("inputs:blackbody_tint", "black bodies have no tint", "its mean is a factor on them")


_SHADERS: dict[str, Callable[[Node], Optics]] = {
    "volume": _materialx,
    "kma_volume": _materialx,
    "standard_volume": _arnold,
    "principled_volume": _cycles,
}
