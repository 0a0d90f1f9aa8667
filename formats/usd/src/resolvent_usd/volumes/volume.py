"""UsdVol Volume: a medium of the grids of OpenVDB files.

Names of fields, without upper case, say what they are where no shader does (``ROLES``). Extinction is per length of the
stage's unit: a density of 1 without a material is an extinction of 1, times ``primvars:densityScale`` where it is authored.
"""

from __future__ import annotations

import numpy as np
from pxr import UsdGeom, UsdLux, UsdVol

from .. import materials
from ..claim import Claim
from ..context import Context
from ..registry import converts
from ..report import InputError
from ..scene import Json, Matrix, rgb, rows
from ..shading import network
from .fields import Field, read
from .optics import Color, Optics, Term
from .shaders import CONTEXTS, optics_of

ROLES = {
    "density": ("density", "dens", "smoke", "fog", "cloud"),
    "temperature": ("temperature", "temp", "heat"),
    "emission": ("emission", "flame", "flames", "fire", "incandescence"),
    "albedo": ("albedo", "cd", "color", "colour", "scattercolor", "scatter_color"),
    "velocity": ("velocity", "vel", "v"),
}
_DEFAULT_ALBEDO = 0.99


@converts("Volume", per_instance=True)
def volume(ctx: Context, claim: Claim) -> None:
    """One medium; several that overlap superpose."""
    claim.take("doubleSided", "orientation", "primvars:displayColor", "primvars:displayOpacity")
    claim.take_prefix("material:binding")
    claim.take_prefix("field:")
    claim.take_schema("MaterialBindingAPI")
    if claim.prim.HasAPI(UsdLux.LightAPI):
        claim.skipped("VolumeLightAPI", "volumes emit as their material says", "the light's own controls have no effect")
        claim.take_schema("LightAPI", "VolumeLightAPI", "CollectionAPI")
        claim.take_prefix("inputs:")
        claim.take_prefix("light:")
    paths = UsdVol.Volume(claim.prim).GetFieldPaths()
    optics = _optics(ctx, claim)
    fields = {str(name): f for name, path in paths.items() if (f := read(ctx, claim, str(name), path)) is not None}
    if not fields:
        claim.skipped("", "a volume without fields: only those of OpenVDB files can be shown", "it can't be seen")
        return
    if optics is None:
        optics = _by_names(claim, fields)
    scale = _density_scale(claim)
    medium = _medium(ctx, claim, fields, optics, scale)
    if medium is not None:
        ctx.scene.medium(claim.path, medium)


def _optics(ctx: Context, claim: Claim) -> Optics | None:
    """What the bound volume shader says."""
    material = materials.bound(ctx, claim, None)
    if material is None:
        return None
    found = network(ctx).terminal(material, "volume", CONTEXTS)
    if found is None:
        claim.skipped(
            "material:binding", f"the material {material.GetPath()} has no volume shader", "the volume looks as if it had no material"
        )
        return None
    return optics_of(found[0])


def _role(name: str) -> str | None:
    plain = name.lower()
    return next((role for role, names in ROLES.items() if plain in names), None)


def _by_names(claim: Claim, fields: dict[str, Field]) -> Optics:
    """Without a material: what the names say."""
    out = Optics(albedo=Term(np.full(3, _DEFAULT_ALBEDO)))
    roles = {role: name for name in reversed(list(fields)) if (role := _role(name))}
    density = roles.get("density")
    if density is None:
        free = [n for n in fields if _role(n) is None and not fields[n].vector]
        density = free[0] if free else None
        if density is None:
            raise InputError(claim.path, f"none of its fields is a density: {', '.join(fields)}")
        claim.approximated(f"field:{density}", "no field is called 'density'", "this one is taken for it")
    out.extinction = Term(fields=(density,))
    look = f"extinction 1 per unit of density, albedo {_DEFAULT_ALBEDO}, no direction favoured"
    if "albedo" in roles:
        out.albedo = Term(fields=(roles["albedo"],))
    elif (tint := _display_color(claim)) is not None:
        out.albedo = Term(tint)
        look = f"extinction 1 per unit of density, the albedo of displayColor {tint.tolist()}"
    if "emission" in roles:
        out.emission = Term(fields=(roles["emission"],))
        look += ", and emits what its emission field says per unit of length"
    claim.approximated("", "no material says what the volume looks like", look)
    if "temperature" in roles:
        claim.skipped(f"field:{roles['temperature']}", "no material says how it glows", "it does not glow")
    return out


def _display_color(claim: Claim) -> Color | None:
    value = UsdGeom.Gprim(claim.prim).GetDisplayColorAttr().Get(claim.ctx.time)
    if value is None or len(value) == 0:
        return None
    return np.asarray(np.clip(np.asarray(value, dtype=float).mean(axis=0), 0.0, 1.0))


def _density_scale(claim: Claim) -> float:
    name = "primvars:densityScale"
    found = claim.get(name)
    if found is None:
        return 1.0
    flat = np.asarray(found, dtype=float).reshape(-1)
    return float(flat[0]) if flat.size else 1.0


def _medium(ctx: Context, claim: Claim, fields: dict[str, Field], optics: Optics, scale: float) -> Json | None:
    density = _field(claim, fields, optics.extinction, "extinction")
    sigma = optics.extinction.factor * scale
    if density is None:
        if not optics.extinction.factor.any() and optics.emission.fields:
            density = _field(claim, fields, optics.emission, "emission")
        if density is None:
            claim.skipped("", "its material gives it no density from a field", "it can't be seen")
            return None
    if sigma.min() < 0.0:
        raise InputError(claim.path, f"its extinction is negative: {sigma.tolist()} per unit of density")
    params: Json = {"file": density.file, "grid": density.grid, "sigma_t": rgb(sigma)}
    albedo = np.clip(optics.albedo.factor, 0.0, 1.0)
    params["albedo"] = rgb(albedo)
    if optics.albedo.fields:
        _channel(claim, fields, optics.albedo, "albedo", density, params, "albedo_grid")
    if optics.emission.factor.any():
        emission = optics.emission
        if emission.fields:
            extra = tuple(f for f in emission.fields if f != density.name)
            shown = Term(emission.factor, extra or emission.fields)
            if _channel(claim, fields, shown, "emission", density, params, "emission_grid"):
                params["emission"] = rgb(np.maximum(emission.factor, 0.0))
        else:
            claim.skipped("", "emission that no field bounds has no end", "the volume does not glow")
    if optics.temperature is not None and optics.blackbody > 0.0:
        if _channel(claim, fields, optics.temperature, "temperature", density, params, "temperature"):
            params["temperature_scale"] = float(optics.temperature.factor[0])
            # Radiances are absolute per metre elsewhere; lengths here are the stage's.
            params["emission_scale"] = optics.blackbody
    phase = _phase(optics)
    if phase is not None:
        params["phase"] = phase
    _leftover(claim, fields, params, density)
    out: Json = {"plugin": "vdb", "params": params}
    matrix = claim.matrix @ density.matrix
    if density.info is not None and density.info.get("bounds_world"):
        lo, hi = density.info["bounds_world"]
        box = np.array([[(lo, hi)[i >> k & 1][k] for k in range(3)] for i in range(8)], dtype=float)
        ctx.corners.append(box @ matrix[:3, :3].T + matrix[:3, 3])
    if not np.array_equal(matrix, np.eye(4)):
        out["transform"] = rows(matrix)
    return out


def _field(claim: Claim, fields: dict[str, Field], term: Term, what: str) -> Field | None:
    """The one field of a term; several are more than a medium can multiply."""
    if not term.fields:
        return None
    names = list(dict.fromkeys(term.fields))
    known = [n for n in names if n in fields]
    missing = [n for n in names if n not in fields]
    if missing:
        claim.approximated(
            f"field:{missing[0]}",
            f"the material's {what} reads this field, which the volume does not have (it has: {', '.join(fields)})",
            "it is taken as 1" if known else f"no {what}",
        )
    if not known:
        return None
    if len(known) > 1:
        claim.approximated(f"field:{known[1]}", f"the {what} is a product of fields", f"only '{known[0]}' is used")
    return fields[known[0]]


def _channel(
    claim: Claim, fields: dict[str, Field], term: Term, what: str, density: Field, params: Json, prefix: str
) -> Field | None:
    """A grid beside the density, with its file and its place where they are its own."""
    found = _field(claim, fields, term, what)
    if found is None:
        return None
    params["temperature_grid" if prefix == "temperature" else prefix] = found.grid
    if found.file != density.file:
        params[f"{prefix}_file"] = found.file
    place: Matrix = np.linalg.inv(density.matrix) @ found.matrix
    if np.abs(place - np.eye(4)).max() > 1e-12:
        params[f"{prefix}_transform"] = [float(x) for x in place[:3].reshape(-1)]
    return found


def _phase(optics: Optics) -> Json | None:
    def hg(g: float) -> Json:
        return {"plugin": "hg", "params": {"g": float(np.clip(g, -0.999, 0.999))}}

    share = float(np.clip(optics.mix, 0.0, 1.0))
    if share > 0.0 and optics.g2 != optics.g:
        g1, g2 = (float(np.clip(g, -0.999, 0.999)) for g in (optics.g, optics.g2))
        return {"plugin": "two-lobe-hg", "params": {"g1": g1, "g2": g2, "weight": 1.0 - share}}
    return hg(optics.g) if optics.g != 0.0 else None


def _leftover(claim: Claim, fields: dict[str, Field], params: Json, density: Field) -> None:
    """Fields that nothing reads."""
    used = {density.grid} | {params.get(k) for k in ("albedo_grid", "emission_grid", "temperature_grid")}
    for name, found in fields.items():
        if found.grid in used:
            continue
        if _role(name) == "velocity":
            claim.skipped(f"field:{name}", "motion blur is not rendered", "the picture shows one instant")
        else:
            claim.skipped(f"field:{name}", "the volume's material does not read it", "no effect")
