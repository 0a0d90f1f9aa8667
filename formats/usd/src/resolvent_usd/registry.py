"""Which function converts prims of which schema type."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from .claim import Claim
    from .context import Context

Convert = Callable[["Context", "Claim"], None]


@dataclass(frozen=True)
class Converter:
    """How prims of one type are converted."""

    convert: Convert
    per_instance: bool
    """Called for every copy apart, with the prim's matrix to the world: for lights and media, which can't be instanced."""


CONVERTERS: dict[str, Converter] = {}


def converts(*types: str, per_instance: bool = False) -> Callable[[Convert], Convert]:
    """Registers the function for prims of these schema types (``prim.GetTypeName()``)."""

    def register(function: Convert) -> Convert:
        for name in types:
            if name in CONVERTERS:
                raise ValueError(f"two converters of {name}")
            CONVERTERS[name] = Converter(function, per_instance)
        return function

    return register
