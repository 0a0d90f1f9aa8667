"""All converters: importing this module registers them."""

from __future__ import annotations

from . import cameras, geometry, lights, render_settings, shading, volumes  # noqa: F401
from .context import Context


def finish(ctx: Context) -> None:
    """What is made of the stage as a whole, after the walk."""
    cameras.finish(ctx)
