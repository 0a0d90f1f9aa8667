"""Geometry of stages: meshes, implicit shapes, curves, points and instancers."""

from . import curves, implicit, instancer, mesh, points

__all__ = ["curves", "implicit", "instancer", "mesh", "points"]
