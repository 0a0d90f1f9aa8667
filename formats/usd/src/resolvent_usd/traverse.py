"""The walk through a stage: every prim is converted, or the report says that it is not."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from pxr import Usd, UsdGeom

from .context import Context
from .groups import Copies, Group
from .registry import CONVERTERS, Converter
from .report import InputError
from .scene import Matrix
from .xform import local_matrix, singular

# Prims that place others and show nothing themselves.
_FRAMES = {"", "Xform", "Scope"}
_CHILDREN = Usd.TraverseInstanceProxies(Usd.PrimDefaultPredicate)


@dataclass(frozen=True)
class Place:
    """Where the walk stands: what a prim inherits from its parents."""

    group: Group
    matrix: Matrix
    purpose: str = "default"


class Walk:
    """One walk; groups of native instances are shared through it."""

    def __init__(self, ctx: Context) -> None:
        self.ctx = ctx
        self._prototypes: dict[object, Group] = {}
        self._open: set[str] = set()
        ctx.walk = self

    def stage(self) -> None:
        """Walks the whole stage and reports what was not used."""
        root = Place(self.ctx.world, np.eye(4))
        self.below(self.ctx.stage.GetPseudoRoot(), root)

    def below(self, parent: Usd.Prim, place: Place) -> None:
        """Walks the prims below ``parent``, in the stage's order; without recursion, for stages may be deep."""
        stack = [(prim, place) for prim in reversed(parent.GetFilteredChildren(_CHILDREN))]
        while stack:
            prim, place = stack.pop()
            inner = self._guarded(prim, place)
            if inner is not None:
                stack += [(child, inner) for child in reversed(prim.GetFilteredChildren(_CHILDREN))]

    def prim(self, prim: Usd.Prim, place: Place) -> None:
        """Walks a prim and what is below it."""
        inner = self._guarded(prim, place)
        if inner is not None:
            self.below(prim, inner)

    def _guarded(self, prim: Usd.Prim, place: Place) -> Place | None:
        """Converts one prim; the place for its children, or None if they are not to be walked."""
        try:
            return self._visit(prim, place)
        except InputError as error:
            if not self.ctx.options.keep_going:
                raise
            self.ctx.report.failed(error)
            return None

    def _visit(self, prim: Usd.Prim, place: Place) -> Place | None:
        inner = self._enter(prim, place)
        if inner is None:
            return None
        if prim.IsInstance():
            self._instance(prim, inner)
            return None
        return inner if self.convert(prim, inner) else None

    def _enter(self, prim: Usd.Prim, place: Place) -> Place | None:
        """The prim's own place; None if it is not to be seen."""
        ctx = self.ctx
        imageable = UsdGeom.Imageable(prim)
        if not imageable:
            return place
        if imageable.GetVisibilityAttr().Get(ctx.time) == UsdGeom.Tokens.invisible:
            ctx.report.note(prim.GetPath(), "invisible")
            return None
        purpose = place.purpose
        attribute = imageable.GetPurposeAttr()
        if attribute.HasAuthoredValue():
            purpose = str(attribute.Get())
        if purpose not in ctx.purposes:
            ctx.report.note(prim.GetPath(), f"purpose {purpose}")
            return None
        if not UsdGeom.Xformable(prim):
            return replace(place, purpose=purpose)
        local, resets = local_matrix(ctx, prim)
        matrix = place.matrix @ local
        group = place.group
        if resets:
            matrix, group = local, ctx.world
        if singular(local):
            ctx.report.skipped(prim.GetPath(), "xformOpOrder", "its transform flattens space", "it can't be seen")
            return None
        return Place(group, matrix, purpose)

    def convert(self, prim: Usd.Prim, place: Place) -> bool:
        """Converts the prim itself; true if its children are still to be walked."""
        kind = str(prim.GetTypeName())
        converter = CONVERTERS.get(kind)
        if converter is None:
            if kind not in _FRAMES:
                self._unknown(prim, kind)
                return True
            claim = self.ctx.claim(prim, place.matrix, place.group)
            claim.take_prefix("primvars:")
            claim.take_prefix("material:binding")
            claim.take_schema("MaterialBindingAPI", "CollectionAPI", "GeomModelAPI")
            return True
        claim = self.ctx.claim(prim, place.matrix, place.group, place.purpose)
        if converter.per_instance and place.group is not self.ctx.world:
            place.group.defer(self._later(converter, prim), place.matrix)
            return True
        converter.convert(self.ctx, claim)
        return not claim.pruned

    def _later(self, converter: Converter, prim: Usd.Prim) -> Callable[[Matrix], None]:
        def make(matrix: Matrix) -> None:
            converter.convert(self.ctx, self.ctx.claim(prim, matrix, self.ctx.world))

        return make

    def _unknown(self, prim: Usd.Prim, kind: str) -> None:
        known = prim.GetPrimTypeInfo().GetSchemaType()
        reason = "prims of this type are not converted" if known else "no schema of this name is known"
        self.ctx.report.skipped(prim.GetPath(), kind, reason, "not in the scene; its children are converted")

    def _instance(self, prim: Usd.Prim, place: Place) -> None:
        """A native instance: its prototype's group, shared by the instances that look the same."""
        key = (str(prim.GetPrototype().GetPath()), place.purpose, self._inherited(prim))
        group = self._prototypes.get(key)
        if group is None:
            group = Group(str(prim.GetPath()))
            self._prototypes[key] = group
            inner = Place(group, np.eye(4), place.purpose)
            if self.convert(prim, inner):
                self.below(prim, inner)
        place.group.copies.append(Copies(group, place.matrix[None]))

    def prototype(self, prim: Usd.Prim, purpose: str) -> Group:
        """The group of a point instancer's prototype, with the prototype's own transform; shared by all that name it."""
        path = str(prim.GetPath())
        if path in self._open:
            raise InputError(path, "is a prototype of an instancer that it contains: this would never end")
        key = (path, purpose)
        group = self._prototypes.get(key)
        if group is None:
            group = Group(path)
            self._prototypes[key] = group
            self._open.add(path)
            try:
                self.prim(prim, Place(group, np.eye(4), purpose))
            finally:
                self._open.discard(path)
        return group

    def _inherited(self, prim: Usd.Prim) -> object:
        """What an instance inherits that changes the look of its prims: bindings and primvars of the prims above, and its own."""
        parts: list[object] = []
        instance = str(prim.GetPath())
        while prim and not prim.IsPseudoRoot():
            for name in prim.GetAuthoredPropertyNames():
                if name.startswith("material:binding"):
                    relationship = prim.GetRelationship(name)
                    targets = tuple(map(str, relationship.GetTargets()))
                    strength = relationship.GetMetadata("bindMaterialAs")
                    # A collection may name prims inside one instance only.
                    apart = instance if ":collection" in name else ""
                    parts.append((name, targets, strength, apart))
                elif name.startswith("primvars:"):
                    parts.append((name, repr(prim.GetAttribute(name).Get(self.ctx.time))))
            prim = prim.GetParent()
        return tuple(parts)
