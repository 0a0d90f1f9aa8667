"""UsdVol: volumes and their fields."""

from . import fields, volume

__all__ = ["fields", "volume"]
