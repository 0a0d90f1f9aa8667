"""UsdGeom Camera: apertures, offsets, lens and exposure; the film that goes with them."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from pxr import Usd, UsdGeom

from .claim import Claim
from .context import Context
from .registry import converts
from .report import InputError
from .scene import Json, Matrix, rows
from .xform import matrix_of

APERTURE_UNIT = 0.1
"""Apertures and focal lengths are in tenths of a scene unit."""

DEFAULT_WIDTH = 1280


@converts("Camera", per_instance=True)
def camera(ctx: Context, claim: Claim) -> None:
    """Cameras are gathered by the walk; one of them is taken at the end."""
    claim.release()
    ctx.cameras.append((claim.path, claim.matrix))


def finish(ctx: Context) -> None:
    """Chooses the scene's camera and sizes the film."""
    found = _chosen(ctx)
    if found is None:
        _guess(ctx)
        return
    prim, matrix = found
    claim = ctx.claim(prim, matrix, ctx.world)
    window = _Window.read(claim)
    size = ctx.settings.resolution or _default_size(window)
    pixel_aspect = window.conform(ctx.settings.conform, size, ctx.settings.pixel_aspect)
    ctx.scene.camera = _camera(ctx, claim, window)
    ctx.scene.film = _film(ctx, size, pixel_aspect)


def _chosen(ctx: Context) -> tuple[Usd.Prim, Matrix] | None:
    """The camera that the command line, else the render settings name, else the first one that the walk met."""
    for name, source in ((ctx.options.camera, "--camera"), (ctx.settings.camera, "the render settings")):
        if name is None:
            continue
        prim = ctx.stage.GetPrimAtPath(name)
        if not prim or not UsdGeom.Camera(prim):
            raise InputError(name, f"{source}: names no camera")
        # It need not be visible, nor have a purpose that is drawn.
        return prim, matrix_of(ctx.xforms.GetLocalToWorldTransform(prim))
    if not ctx.cameras:
        return None
    path, matrix = ctx.cameras[0]
    for other, _ in ctx.cameras[1:]:
        ctx.report.note(other, f"a camera besides {path}; --camera chooses one")
    return ctx.stage.GetPrimAtPath(path), matrix


@dataclass
class _Window:
    """The part of the image plane that the film covers, in tenths of a scene unit."""

    width: float
    height: float
    x: float
    """Middle."""
    y: float

    @staticmethod
    def read(claim: Claim) -> _Window:
        w, h = (float(claim.get(f"{d}Aperture")) for d in ("horizontal", "vertical"))
        if w <= 0 or h <= 0:
            raise InputError(claim.path, f"has an aperture of {w:g} by {h:g}: both must be > 0")
        x, y = (float(claim.get(f"{d}ApertureOffset")) for d in ("horizontal", "vertical"))
        return _Window(w, h, x, y)

    def conform(self, policy: str, size: tuple[int, int], pixel_aspect: float) -> float:
        """Brings the window into the picture's shape around its middle (UsdRender's aspectRatioConformPolicy); the pixels' aspect."""
        shape = size[0] * pixel_aspect / size[1]
        if policy == "adjustPixelAspectRatio":
            return self.width / self.height * size[1] / size[0]
        wider = shape > self.width / self.height
        match policy:
            case "adjustApertureWidth":
                change_width = True
            case "adjustApertureHeight":
                change_width = False
            case "cropAperture":
                change_width = not wider
            case _:
                change_width = wider
        if change_width:
            self.width = self.height * shape
        else:
            self.height = self.width / shape
        return pixel_aspect


def _default_size(window: _Window) -> tuple[int, int]:
    shape = window.width / window.height
    if shape >= 1:
        return DEFAULT_WIDTH, min(max(round(DEFAULT_WIDTH / shape), 1), 65_536)
    return min(max(round(DEFAULT_WIDTH * shape), 1), 65_536), DEFAULT_WIDTH


def _camera(ctx: Context, claim: Claim, window: _Window) -> Json:
    scale = _scale(claim)
    out: Json = {"transform": rows(_rigid(claim.matrix))}
    shift = [window.x / window.width, window.y / window.height]
    if claim.get("projection") == UsdGeom.Tokens.orthographic:
        width = window.width * APERTURE_UNIT * scale
        out = {"type": "orthographic", **out, "width": width}
        claim.take("focalLength")
        if float(claim.get("fStop")) > 0 and ctx.settings.depth_of_field:
            claim.skipped("fStop", "parallel rays have no lens", "everything is sharp")
        claim.take("fStop", "focusDistance")
    else:
        focal = float(claim.get("focalLength"))
        if focal <= 0:
            raise InputError(f"{claim.path}.focalLength", f"is {focal:g}: must be > 0")
        out = {"type": "perspective", **out, "fov_x_deg": math.degrees(2 * math.atan(0.5 * window.width / focal))}
        _lens(ctx, claim, out, focal, scale)
    if shift != [0.0, 0.0]:
        out["shift"] = shift
    if (exposure := _exposure(claim)) != 0:
        out["exposure"] = exposure
    _without_effect(claim)
    return out


def _lens(ctx: Context, claim: Claim, out: Json, focal: float, scale: float) -> None:
    """A thin lens: its diameter is the focal length over fStop; both are in tenths of a unit, focusDistance in units."""
    f_stop, focus = float(claim.get("fStop")), float(claim.get("focusDistance"))
    if f_stop <= 0 or not ctx.settings.depth_of_field:
        return
    if focus <= 0:
        claim.approximated("focusDistance", f"is {focus:g}, where fStop asks for a distance > 0", "everything is sharp")
        return
    out["lens_radius"] = 0.5 * focal / f_stop * APERTURE_UNIT * scale
    out["focus_distance"] = focus * scale


def _exposure(claim: Claim) -> float:
    """Stops of UsdGeomCamera::ComputeLinearExposureScale: 2^exposure · time · iso/100 · responsivity / fStop²."""
    stops = float(claim.get("exposure", 0.0))
    time, iso, f_stop, responsivity = (
        float(claim.get(f"exposure:{name}", default))
        for name, default in (("time", 1.0), ("iso", 100.0), ("fStop", 1.0), ("responsivity", 1.0))
    )
    if min(time, iso, f_stop, responsivity) <= 0:
        raise InputError(claim.path, "has an exposure time, iso, fStop or responsivity that is not > 0: the picture would be black")
    return stops + math.log2(time * iso / 100.0 * responsivity / (f_stop * f_stop))


def _scale(claim: Claim) -> float:
    """The camera's unit in the world's; a camera that its transform stretches unevenly sees like one that is not."""
    lengths = np.linalg.norm(claim.matrix[:3, :3], axis=0)
    axes = claim.matrix[:3, :3] / lengths
    if np.ptp(lengths) > 1e-6 * lengths.max() or np.abs(axes.T @ axes - np.eye(3)).max() > 1e-6:
        claim.approximated("xformOpOrder", "the transform stretches or shears the camera", "only its place and directions are used")
    return float(np.cbrt(np.prod(lengths)))


def _rigid(matrix: Matrix) -> Matrix:
    """The same pose without scale."""
    out = matrix.copy()
    out[:3, :3] /= np.linalg.norm(out[:3, :3], axis=0)
    return out


def _without_effect(claim: Claim) -> None:
    claim.take("stereoRole", "projection")
    claim.no_effect("clippingRange", "nothing is clipped", "what is nearer or farther is shown, too")
    claim.no_effect("clippingPlanes", "nothing is clipped", "what they cut off is shown, too")
    if claim.get("shutter:open") != claim.get("shutter:close"):
        claim.no_effect("shutter:open", "motion blur is not rendered", "the picture shows one instant")
        claim.no_effect("shutter:close", "motion blur is not rendered", "the picture shows one instant")
    claim.take("shutter:open", "shutter:close")


def _film(ctx: Context, size: tuple[int, int], pixel_aspect: float) -> Json:
    film: Json = {"resolution": list(size)}
    if pixel_aspect != 1.0:
        film["pixel_aspect"] = pixel_aspect
    x0, y0, x1, y1 = ctx.settings.data_window
    if (x0, y0, x1, y1) != (0.0, 0.0, 1.0, 1.0):
        w, h = size
        # Pixels whose centres are inside; NDC's y points up, the film's down.
        crop = [math.ceil(x0 * w - 0.5), math.ceil((1 - y1) * h - 0.5), math.ceil(x1 * w - 0.5), math.ceil((1 - y0) * h - 0.5)]
        inside = [max(crop[0], 0), max(crop[1], 0), min(crop[2], w), min(crop[3], h)]
        if inside[0] >= inside[2] or inside[1] >= inside[3]:
            raise InputError("/", f"the render settings' dataWindowNDC ({x0:g}, {y0:g}, {x1:g}, {y1:g}) has no pixels in the picture")
        if inside != crop:
            ctx.report.skipped("/", "dataWindowNDC", "there is no overscan", "the window ends at the picture's edges")
        film["crop"] = inside
    if ctx.settings.aovs:
        film["aovs"] = list(ctx.settings.aovs)
    return film


def _guess(ctx: Context) -> None:
    """Without a camera: one that sees everything."""
    purposes = list(ctx.purposes)
    box = UsdGeom.BBoxCache(ctx.time, purposes, True).ComputeWorldBound(ctx.stage.GetPseudoRoot()).ComputeAlignedRange()
    lo, hi = (np.array(box.GetMin()), np.array(box.GetMax())) if not box.IsEmpty() else (-np.ones(3), np.ones(3))
    if ctx.corners:
        known = [np.stack([lo, hi])] if not box.IsEmpty() else []
        points = np.concatenate([*known, *ctx.corners])
        lo, hi = points.min(axis=0), points.max(axis=0)
    if not (np.isfinite(lo).all() and np.isfinite(hi).all()):
        lo, hi = -np.ones(3), np.ones(3)
    centre, radius = 0.5 * (lo + hi), max(0.5 * float(np.linalg.norm(hi - lo)), 1e-6)
    up = [0.0, 0.0, 1.0] if ctx.up_axis == "Z" else [0.0, 1.0, 0.0]
    aside = np.array([0.45, -0.8, 0.4] if ctx.up_axis == "Z" else [0.45, 0.4, 0.8])
    fov, size = 40.0, ctx.settings.resolution or (DEFAULT_WIDTH, 720)
    half = math.radians(0.5 * fov)
    half = min(half, math.atan(math.tan(half) * size[1] / size[0]))
    origin = centre + aside / np.linalg.norm(aside) * radius / math.sin(half)
    ctx.report.approximated("/", "camera", "the stage has no camera", "one is placed that sees everything")
    ctx.scene.camera = {
        "type": "perspective", "origin": [float(x) for x in origin], "target": [float(x) for x in centre], "up": up,
        "fov_x_deg": fov,
    }  # fmt: skip
    ctx.scene.film = _film(ctx, size, ctx.settings.pixel_aspect)
