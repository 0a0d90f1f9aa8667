"""UsdRender: resolution, window, camera, purposes and layers, as settings and products state them."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from pxr import Usd, UsdRender

from .claim import Claim
from .context import Context
from .registry import converts
from .report import InputError

# Names of render variables (sourceName, in lower case) and our layers; None is the picture itself.
_LAYERS: dict[str, str | None] = {
    "ci": None, "color": None, "c": None, "rgba": None, "rgb": None, "beauty": None, "combined": None, "a": None, "alpha": None,
    "lpe:c.*": None, "c.*": None, "c.*[<l.>o]": None, "lpe:c.*[<l.>o]": None,
    "depth": "depth", "z": "depth", "cameradepth": "depth", "__depth": "depth",
    "n": "normal", "normal": "normal", "nworld": "normal", "neye": "normal", "nn": "normal",
    "albedo": "albedo", "diffuse_albedo": "albedo", "denoise_albedo": "albedo",
    "variance": "variance", "samplecount": "samples", "sample_count": "samples",
}  # fmt: skip


@dataclass
class RenderSettings:
    """What the stage says about the picture; None where it says nothing."""

    resolution: tuple[int, int] | None = None
    pixel_aspect: float = 1.0
    conform: str = "expandAperture"
    data_window: tuple[float, float, float, float] = (0.0, 0.0, 1.0, 1.0)
    camera: str | None = None
    depth_of_field: bool = True
    purposes: tuple[str, ...] | None = None
    material_purposes: tuple[str, ...] = ("full", "")
    aovs: list[str] = field(default_factory=list)
    paths: set[str] = field(default_factory=set)
    """Prims that these settings come from."""


def read(ctx: Context) -> RenderSettings:
    """The settings that the command line or the stage names, else the only ones of the stage, else none."""
    prim = _chosen(ctx)
    settings = RenderSettings()
    if prim is None:
        return settings
    claim = ctx.claim(prim, np.eye(4), ctx.world)
    settings.paths.add(claim.path)
    claim.take("includedPurposes", "materialBindingPurposes")
    _base(claim, settings)
    if claim.authored("includedPurposes"):
        settings.purposes = tuple(map(str, claim.get("includedPurposes")))
    if claim.authored("materialBindingPurposes"):
        settings.material_purposes = tuple(map(str, claim.get("materialBindingPurposes")))
    space = claim.get("renderingColorSpace")
    if space and str(space) not in ("lin_rec709", "lin_rec709_scene", "lin_srgb", "linear", "auto"):
        claim.skipped("renderingColorSpace", f"'{space}': pictures are in linear Rec. 709", "colours are those of Rec. 709")
    _products(ctx, claim, settings)
    return settings


def _chosen(ctx: Context) -> Usd.Prim | None:
    named = ctx.options.render_settings
    if named is not None:
        prim = ctx.stage.GetPrimAtPath(named)
        if not prim or not UsdRender.Settings(prim):
            raise InputError(named, "--render-settings names no RenderSettings prim")
        return prim
    settings = UsdRender.Settings.GetStageRenderSettings(ctx.stage)
    if settings:
        return settings.GetPrim()
    all_settings = [p for p in ctx.stage.Traverse() if p.GetTypeName() == "RenderSettings"]
    if len(all_settings) > 1:
        for prim in all_settings:
            ctx.report.note(prim.GetPath(), "one of several render settings; --render-settings chooses one")
    return all_settings[0] if len(all_settings) == 1 else None


def _base(claim: Claim, settings: RenderSettings) -> None:
    """What settings and products share; a product overrides what it authors."""
    product = claim.prim.GetTypeName() == "RenderProduct"

    def given(name: str) -> Any:
        value = claim.get(name)
        return value if value is not None and (not product or claim.authored(name)) else None

    if (resolution := given("resolution")) is not None:
        if min(resolution) < 1 or max(resolution) > 65_536:
            raise InputError(f"{claim.path}.resolution", f"is {resolution}: must be from 1 to 65536")
        if product or claim.authored("resolution"):
            settings.resolution = (int(resolution[0]), int(resolution[1]))
    if (aspect := given("pixelAspectRatio")) is not None:
        if not 0.01 <= aspect <= 100:
            raise InputError(f"{claim.path}.pixelAspectRatio", f"is {aspect}: must be from 0.01 to 100")
        settings.pixel_aspect = float(aspect)
    if (conform := given("aspectRatioConformPolicy")) is not None:
        settings.conform = str(conform)
    if (window := given("dataWindowNDC")) is not None:
        settings.data_window = tuple(float(x) for x in window)  # type: ignore[assignment]
    if (off := given("disableDepthOfField")) is not None:
        settings.depth_of_field = not off
    claim.take("disableMotionBlur", "instantaneousShutter")  # There is none.
    if targets := claim.targets("camera"):
        settings.camera = str(targets[0])


def _products(ctx: Context, claim: Claim, settings: RenderSettings) -> None:
    used = False
    for path in claim.targets("products"):
        prim = ctx.stage.GetPrimAtPath(path)
        if not prim or prim.GetTypeName() != "RenderProduct":
            claim.skipped("products", f"'{path}' is no RenderProduct", "it is not rendered")
            continue
        product = ctx.claim(prim, np.eye(4), ctx.world)
        settings.paths.add(product.path)
        if used:
            product.release()
            ctx.report.skipped(product.path, "", "one picture is rendered at a time", "the first raster product is")
            continue
        if str(product.get("productType")) != "raster":
            product.release()
            ctx.report.skipped(product.path, "productType", f"'{product.get('productType')}' is no picture", "it is not made")
            continue
        used = True
        if name := product.get("productName"):
            ctx.report.note(product.path, f"productName '{name}': the command line names the picture")
        _base(product, settings)
        for var in product.targets("orderedVars"):
            _var(ctx, product, str(var), settings)


def _var(ctx: Context, product: Claim, path: str, settings: RenderSettings) -> None:
    prim = ctx.stage.GetPrimAtPath(path)
    if not prim:
        product.skipped("orderedVars", f"'{path}' is not there", "no such layer")
        return
    var = ctx.claim(prim, np.eye(4), ctx.world)
    settings.paths.add(var.path)
    name, kind = str(var.get("sourceName")), str(var.get("sourceType"))
    var.take("dataType")
    key = name.lower()
    if kind not in ("raw", "intrinsic", "lpe") or key not in _LAYERS:
        var.skipped("sourceName", f"there is no layer for the {kind} variable '{name}'", "it is left out")
        return
    layer = _LAYERS[key]
    if layer == "depth" and key != "cameradepth":
        var.approximated("sourceName", "depth is measured along the ray", "not along the camera's axis")
    if layer is not None and layer not in settings.aovs:
        settings.aovs.append(layer)


@converts("RenderSettings", "RenderProduct", "RenderVar")
def other(ctx: Context, claim: Claim) -> None:
    """What belongs to the chosen settings was read before; others are alternatives."""
    claim.release()
    if claim.path not in ctx.settings.paths:
        ctx.report.note(claim.path, "does not belong to the render settings in use")
