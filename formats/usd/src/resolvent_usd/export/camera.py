"""The camera and its film."""

from __future__ import annotations

import numpy as np
from pxr import Gf, UsdGeom, UsdRender

from ..scene import Matrix
from .stage import Target, frame, matrix, place

# Tenths of a unit, of any size: only proportions count.
_WIDTH = 36.0


def write(target: Target) -> None:
    """The scene's camera, and render settings with its resolution."""
    c = target.scene.get("camera")
    film = target.scene.get("film", {})
    width, height = film.get("resolution", [1280, 720])
    aspect = float(film.get("pixel_aspect", 1.0))
    settings = UsdRender.Settings.Define(target.stage, "/Render/settings")
    settings.CreateResolutionAttr(Gf.Vec2i(width, height))
    settings.CreatePixelAspectRatioAttr(aspect)
    target.stage.SetMetadata("renderSettingsPrimPath", "/Render/settings")
    if (crop := film.get("crop")) is not None:
        x0, y0, x1, y1 = crop
        settings.CreateDataWindowNDCAttr(Gf.Vec4f(x0 / width, 1 - y1 / height, x1 / width, 1 - y0 / height))
    for key in ("filter", "aovs"):
        if film.get(key):
            target.report.skipped("/film", key, "is not written", "the renderer's own is used")
    if c is None:
        return
    path = target.path("camera")
    camera = UsdGeom.Camera.Define(target.stage, path)
    settings.CreateCameraRel().SetTargets([path])
    place(camera, _pose(c))
    camera.CreateExposureAttr(float(c.get("exposure", 0.0)))
    if c.get("type") == "orthographic":
        camera.CreateProjectionAttr(UsdGeom.Tokens.orthographic)
        across = 10.0 * float(c["width"])
    else:
        across = _WIDTH
        focal = 0.5 * across / np.tan(np.radians(0.5 * float(c["fov_x_deg"])))
        camera.CreateFocalLengthAttr(float(focal))
        radius = float(c.get("lens_radius", 0.0))
        if radius > 0.0:
            distance = c.get("focus_distance") or np.linalg.norm(np.subtract(c["target"], c["origin"]))
            camera.CreateFStopAttr(float(0.05 * focal / radius))
            camera.CreateFocusDistanceAttr(float(distance))
    down = across * height / (width * aspect)
    camera.CreateHorizontalApertureAttr(float(across))
    camera.CreateVerticalApertureAttr(float(down))
    right, up = c.get("shift", [0.0, 0.0])
    camera.CreateHorizontalApertureOffsetAttr(float(right * across))
    camera.CreateVerticalApertureOffsetAttr(float(up * down))


def _pose(c: dict) -> Matrix:  # type: ignore[type-arg]
    if "transform" in c:
        return matrix(c["transform"])
    origin, target = np.asarray(c["origin"], dtype=float), np.asarray(c["target"], dtype=float)
    z = (origin - target) / np.linalg.norm(origin - target)
    x = np.cross(c.get("up", (0.0, 1.0, 0.0)), z)
    x /= np.linalg.norm(x)
    return frame(x, np.cross(z, x), z, origin)
