"""UsdLux lights, by OpenUSD's specification since 24.11.

``intensity`` is a radiance: 1 shows as 1. Formulas are those of the schema's documentation
(``pxr/usd/usdLux/schema.usda``); the reference renderer is OpenUSD's hdEmbree.

Areas for ``normalize`` are in square units of the stage, whatever ``metersPerUnit`` says, as in the reference.
"""

from . import area, distant, dome, others

__all__ = ["area", "distant", "dome", "others"]
