"""Shader networks: nodes, their inputs, and what is connected to them."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from pxr import Sdf, Usd, UsdShade

from .registry import converts
from .report import InputError

if TYPE_CHECKING:
    from .claim import Claim
    from .context import Context

MAX_DEPTH = 64
"""Nodes in a row; longer chains are cycles."""


@dataclass(frozen=True)
class Link:
    """What an input is connected to."""

    node: Node
    output: str


class Node:
    """A shader of a network. Every input that is read counts as used; the others are reported."""

    def __init__(self, network: Network, prim: Usd.Prim) -> None:
        self.network = network
        self.prim = prim
        self.shader = UsdShade.Shader(prim)
        self.claim = network.claim_of(prim)
        self.claim.take_prefix("outputs:")
        self.claim.take_prefix("info:")

    @property
    def path(self) -> str:
        return str(self.prim.GetPath())

    @property
    def id(self) -> str:
        """The shader's identifier; empty for those that are code or files."""
        return str(self.shader.GetShaderId() or "")

    @property
    def described(self) -> str:
        """For reports."""
        if self.id:
            return f"'{self.id}'"
        source = str(self.shader.GetImplementationSource() or "")
        return f"a shader by '{source}'" if source else "a shader without identifier"

    def link(self, name: str) -> Link | None:
        """The node that an input is connected to, through node graphs and material inputs."""
        attribute = self._producer(name)
        if attribute is None or UsdShade.Utils.GetType(attribute.GetName()) != UsdShade.AttributeType.Output:
            return None
        node = self.network.node(attribute.GetPrim())
        return Link(node, attribute.GetName().split(":")[-1])

    def connected(self, name: str) -> bool:
        """True if some node computes the input."""
        return self.link(name) is not None

    def value(self, name: str, default: Any = None) -> Any:
        """The input's constant; where a node is connected, the default."""
        attribute = self._producer(name)
        if attribute is None or UsdShade.Utils.GetType(attribute.GetName()) == UsdShade.AttributeType.Output:
            return default
        value = attribute.Get(self.network.ctx.time)
        if value is None:
            return default
        if isinstance(value, (float, int)) or hasattr(value, "__len__"):
            flat = None if isinstance(value, str) else np.asarray(value)
            if flat is not None and flat.dtype.kind == "f" and not np.isfinite(flat).all():
                raise InputError(attribute.GetPath(), "has numbers that are not finite (NaN or infinity)")
        return value

    def attribute(self, name: str) -> Usd.Attribute | None:
        """The attribute that gives an input its value."""
        return self._producer(name)

    def _producer(self, name: str) -> Usd.Attribute | None:
        self.claim.take(f"inputs:{name}")
        found = self.shader.GetInput(name)
        if not found:
            return None
        producers = UsdShade.Utils.GetValueProducingAttributes(found)
        if not producers:
            return found.GetAttr() if found.GetAttr().HasValue() else None
        return producers[0]


class Network:
    """The nodes of one conversion, each claimed once."""

    def __init__(self, ctx: Context) -> None:
        self.ctx = ctx
        self.claims: dict[str, Claim] = {}

    def claim_of(self, prim: Usd.Prim) -> Claim:
        path = str(prim.GetPath())
        if path not in self.claims:
            self.claims[path] = self.ctx.claim(prim, np.eye(4), self.ctx.world)
        return self.claims[path]

    def node(self, prim: Usd.Prim) -> Node:
        return Node(self, prim)

    def terminal(self, material: UsdShade.Material, kind: str, contexts: tuple[str, ...]) -> tuple[Node, str] | None:
        """The shader at a material's output ``surface``, ``displacement`` or ``volume``, and the render context it is for."""
        for context in contexts:
            compute = getattr(material, f"Compute{kind.capitalize()}Source")
            shader, _, _ = compute(context)
            if shader:
                output = material.GetOutput(f"{context}:{kind}" if context else kind)
                if output and output.GetAttr().HasAuthoredConnections():
                    self.ctx.used.add((str(material.GetPath()), "outputs"))
                    return self.node(shader.GetPrim()), context
        return None


def network(ctx: Context) -> Network:
    """The conversion's network."""
    found: Network | None = getattr(ctx, "_network", None)
    if found is None:
        found = Network(ctx)
        ctx._network = found  # type: ignore[attr-defined]
    return found


@converts("Material", "Shader", "NodeGraph")
def shading_prim(ctx: Context, claim: Claim) -> None:
    """Read where they are bound; what of them is not used is reported there."""
    claim.take_schema("MaterialXConfigAPI", "CoordSysAPI", "ColorSpaceAPI", "ColorSpaceDefinitionAPI")
    claim.take(*claim.prim.GetAuthoredPropertyNames())
    claim.prune()

    def unused() -> None:
        if (claim.path, "outputs") not in ctx.used and claim.path not in network(ctx).claims:
            ctx.report.note(claim.path, "nothing that is drawn has this material")

    claim.at_end = unused


def asset_of(node: Node, name: str) -> tuple[Sdf.AssetPath, Usd.Attribute] | None:
    """An asset path and the attribute that has it."""
    attribute = node.attribute(name)
    value = node.value(name)
    if attribute is None or not isinstance(value, Sdf.AssetPath) or not value.path:
        return None
    return value, attribute


def anchored(path: str, attribute: Usd.Attribute) -> str:
    """An asset path that names no file as it is (a pattern), made absolute by the layer that says it."""
    for spec in attribute.GetPropertyStack(Usd.TimeCode.Default()):
        if spec.HasInfo("default") or spec.HasInfo("timeSamples"):
            return str(Sdf.ComputeAssetPathRelativeToLayer(spec.layer, path))
    return path
