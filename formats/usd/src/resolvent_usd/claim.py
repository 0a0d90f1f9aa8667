"""A prim that a converter has taken on: every authored property is used, or the report says that it has no effect."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from pxr import Gf, Sdf, Usd

from .report import InputError
from .scene import Matrix

if TYPE_CHECKING:
    from .context import Context
    from .groups import Group

# Properties that the walk itself heeds, or that say nothing about the picture.
_HEEDED = {"xformOpOrder", "visibility", "purpose", "extent", "extentsHint", "proxyPrim"}
_HEEDED_PREFIXES = ("xformOp:", "userProperties:", "ui:", "model:")
# API schemas without a meaning for pictures, or heeded by the walk.
_NEUTRAL_SCHEMAS = {
    "AccessibilityAPI", "AssetPreviewsAPI", "AuthorshipAPI", "ClaimsAPI", "NodeGraphNodeAPI", "SceneGraphPrimAPI",
    "SemanticsLabelsAPI", "StatementsAPI", "ListAPI", "NodeDefAPI", "HydraPrimAPI",
}  # fmt: skip


class Claim:
    """One prim under conversion, with its place."""

    def __init__(self, ctx: Context, prim: Usd.Prim, matrix: Matrix, group: Group, purpose: str = "default") -> None:
        self.ctx = ctx
        self.prim = prim
        self.matrix = matrix
        """Prim to the space of ``group``; for converters that are called once per instance, to the world."""
        self.group = group
        """Where shapes go: the world or a prototype."""
        self.purpose = purpose
        """The prim's purpose, inherited or its own."""
        self.pruned = False
        self.at_end: Callable[[], None] | None = None
        """Called when everything has been converted."""
        self._taken: set[str] = set()
        self._schemas: set[str] = set()
        self._released = False

    @property
    def path(self) -> str:
        return str(self.prim.GetPath())

    def release(self) -> None:
        """Nothing is to be reported of this claim: another one speaks for the prim, or the prim is not asked for."""
        self._released = True

    def prune(self) -> None:
        """The converter has seen to the prim's children, too."""
        self.pruned = True

    # Reading marks a property as used.

    def get(self, name: str, default: Any = None) -> Any:
        """Value of an attribute at the conversion's time (fallbacks included), or ``default``.

        Numbers must be finite.
        """
        self._taken.add(name)
        attribute = self.prim.GetAttribute(name)
        value = attribute.Get(self.ctx.time) if attribute else None
        if value is None:
            return default
        if not _finite(value):
            raise InputError(f"{self.path}.{name}", "has numbers that are not finite (NaN or infinity)")
        return value

    def array(self, name: str, dtype: type = float, width: int | None = None) -> NDArray[Any] | None:
        """Value of an array attribute, or None if it has none; its elements have ``width`` components (None: are numbers)."""
        value = self.get(name)
        if value is None:
            return None
        try:
            array: NDArray[Any] = np.asarray(value, dtype=dtype)
        except (TypeError, ValueError):
            array = np.empty((0, 0, 0))
        if array.ndim == 1 and len(array) == 0 and width is not None:
            array = array.reshape(0, width)
        if array.ndim != (1 if width is None else 2) or (width is not None and array.shape[1] != width):
            found = type(value).__name__
            wanted = "numbers" if width is None else f"elements of {width} numbers"
            raise InputError(f"{self.path}.{name}", f"is of type {found} where a list of {wanted} is expected")
        return array

    def authored(self, name: str) -> bool:
        """True if the stage says something about an attribute."""
        attribute = self.prim.GetAttribute(name)
        return bool(attribute) and attribute.HasAuthoredValue()

    def targets(self, name: str) -> list[Sdf.Path]:
        """Targets of a relationship."""
        self._taken.add(name)
        relationship = self.prim.GetRelationship(name)
        return list(relationship.GetForwardedTargets()) if relationship else []

    def take(self, *names: str) -> None:
        """Marks properties as used (or as without meaning for the picture)."""
        self._taken.update(names)

    def take_prefix(self, prefix: str) -> None:
        """The same for all properties of a namespace."""
        self._taken.update(n for n in self.prim.GetAuthoredPropertyNames() if n.startswith(prefix))

    def take_schema(self, *names: str) -> None:
        """Marks applied API schemas as heeded; instances of multiple-apply schemas by the schema's name."""
        self._schemas.update(names)

    # Reporting marks it, too.

    def skipped(self, what: str, reason: str, consequence: str) -> None:
        self._taken.add(what)
        self.ctx.report.skipped(self.path, what, reason, consequence)

    def approximated(self, what: str, reason: str, consequence: str) -> None:
        self._taken.add(what)
        self.ctx.report.approximated(self.path, what, reason, consequence)

    def no_effect(self, name: str, reason: str, consequence: str) -> None:
        """Reports an attribute if its value is authored."""
        self._taken.add(name)
        value = self.prim.GetAttribute(name).Get(self.ctx.time) if self.authored(name) else None
        if value is not None and not (hasattr(value, "__len__") and len(value) == 0):
            self.skipped(name, reason, consequence)

    def finish(self) -> None:
        """Reports what is authored and was not used."""
        if self.at_end is not None:
            self.at_end()
        if self._released:
            return
        for schema in self.prim.GetAppliedSchemas():
            kind = schema.partition(":")[0]
            if kind not in self._schemas and kind not in _NEUTRAL_SCHEMAS:
                self.ctx.report.skipped(
                    self.path, schema, "this applied schema is not converted", "its properties have no effect"
                )
        for name in self.prim.GetAuthoredPropertyNames():
            if name in self._taken or name in _HEEDED or name.startswith(_HEEDED_PREFIXES):
                continue
            if (self.path, name) in self.ctx.used or not _says_something(self.prim, name):
                continue
            if name.startswith("primvars:"):
                # Data for whoever reads it.
                self.ctx.report.note(self.path, f"{name}: nothing that is converted reads it")
                continue
            self.ctx.report.skipped(
                self.path, name, f"{self.prim.GetTypeName() or 'untyped prim'}: unknown to the converter", "no effect"
            )


def _says_something(prim: Usd.Prim, name: str) -> bool:
    """False for a property that is declared only: without value, connection or target."""
    if attribute := prim.GetAttribute(name):
        return bool(attribute.HasAuthoredValue() or attribute.HasAuthoredConnections())
    return bool(prim.GetRelationship(name).HasAuthoredTargets())


def _finite(value: Any) -> bool:
    if isinstance(value, (bool, int, str, Sdf.AssetPath)):
        return True
    if isinstance(value, (Gf.Quatf, Gf.Quatd, Gf.Quath)):
        return bool(np.isfinite([value.GetReal(), *value.GetImaginary()]).all())
    try:
        array = np.asarray(value)
    except (TypeError, ValueError):
        return True
    return bool(np.isfinite(array).all()) if array.dtype.kind == "f" else True
