"""USD stages to Resolvent scenes.

Reading order: :mod:`convert` (what happens), :mod:`traverse` (the walk), :mod:`claim` (one prim), :mod:`registry` (who
converts what), then the converters: geometry, cameras, lights, volumes, materials.
"""

__version__ = "0.1.0"
