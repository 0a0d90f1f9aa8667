"""References to MaterialX documents (.mtlx): read here, since usd-core as PyPI has it comes without OpenUSD's plugin for them.

A document becomes a layer in memory, laid out as that plugin does: ``/MaterialX/Materials/NAME``, with the shader nodes of each material
below it. Node graphs are flattened: their nodes stand beside the others, and what an interface passes in stands at the nodes.
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any
from xml.etree import ElementTree

from pxr import Ar, Gf, Sdf, Tf, Usd, UsdShade

from .report import InputError
from .shading import MAX_DEPTH

SOURCE = "resolvent:mtlx"
"""In a layer's customLayerData: the documents that it was made of."""

_TYPES = {
    "float": Sdf.ValueTypeNames.Float, "integer": Sdf.ValueTypeNames.Int, "boolean": Sdf.ValueTypeNames.Bool,
    "color3": Sdf.ValueTypeNames.Color3f, "color4": Sdf.ValueTypeNames.Color4f, "vector2": Sdf.ValueTypeNames.Float2,
    "vector3": Sdf.ValueTypeNames.Float3, "vector4": Sdf.ValueTypeNames.Float4, "filename": Sdf.ValueTypeNames.Asset,
    "string": Sdf.ValueTypeNames.String,
}  # fmt: skip
_VECTORS = {2: Gf.Vec2f, 3: Gf.Vec3f, 4: Gf.Vec4f}
_INCLUDE = "{http://www.w3.org/2001/XInclude}include"
_OUTPUTS = {"surfacematerial": ("surface", "displacement"), "volumematerial": ("volume",)}


def compose(stage: Usd.Stage) -> list[InputError]:
    """Replaces references to .mtlx documents, which usd-core could not open, on the session layer; what does not succeed."""
    read: dict[str, Usd.Stage] = {}
    problems: list[InputError] = []
    for path in sorted({broken.rootSite.path for broken in stage.GetCompositionErrors() if known(broken)}):
        try:
            for file, target in _arcs(stage.GetPrimAtPath(path)):
                if file not in read:
                    read[file] = _laid_out(file)
                _refer(stage, path, read[file].GetRootLayer(), target)
        except InputError as problem:
            problems.append(problem)
    return problems


def known(broken: Any) -> bool:
    """True for a composition error that :func:`compose` takes care of."""
    return ".mtlx" in str(broken) and "Cannot determine file format" in str(broken)


def _refer(stage: Usd.Stage, path: Sdf.Path, layer: Sdf.Layer, target: Sdf.Path) -> None:
    source = Sdf.Path("/MaterialX") if target.isEmpty else target
    file = layer.customLayerData[SOURCE][0]
    if not layer.GetPrimAtPath(source):
        materials = ", ".join(str(p.path) for p in layer.GetPrimAtPath("/MaterialX/Materials").nameChildren)
        raise InputError(path, f"refers to <{source}> of {file}, which has no such prim; its materials are: {materials or 'none'}")
    stage.OverridePrim(path).GetReferences().AddReference(layer.identifier, source)
    if not any(spec.layer == layer for spec in stage.GetPrimAtPath(path).GetPrimStack()):
        raise InputError(path, f"refers to {file} from within an instance, where MaterialX documents are not read; refer to it from a prim above")


def sources(stage: Usd.Stage) -> set[str]:
    """The documents that a stage was made of."""
    return {path for layer in stage.GetUsedLayers() for path in layer.customLayerData.get(SOURCE, [])}


def _arcs(prim: Usd.Prim) -> Iterator[tuple[str, Sdf.Path]]:
    """The documents that a prim refers to, and which prims in them."""
    for spec in prim.GetPrimStack():
        for items in (spec.referenceList, spec.payloadList):
            for arc in items.GetAddedOrExplicitItems():
                if arc.assetPath.lower().endswith(".mtlx"):
                    named = spec.layer.ComputeAbsolutePath(arc.assetPath)
                    file = str(Ar.GetResolver().Resolve(named))
                    if not file or Ar.IsPackageRelativePath(file):
                        why = "is in a package, where it is not read" if file else "is not there"
                        raise InputError(prim.GetPath(), f"refers to the MaterialX document {named}, which {why}")
                    yield file, arc.primPath


def _laid_out(file: str) -> Usd.Stage:
    """A document as a stage."""
    document = _Document(file)
    stage = Usd.Stage.CreateInMemory(Tf.MakeValidIdentifier(Path(file).stem) + ".usda")
    stage.SetDefaultPrim(stage.DefinePrim("/MaterialX"))
    stage.DefinePrim("/MaterialX/Materials", "Scope")
    for element in document.root.iter():
        if element.tag in _OUTPUTS:
            _Material(stage, document, element).write()
    stage.GetRootLayer().customLayerData = {SOURCE: document.files}
    return stage


class _Document:
    """An XML document with those that it includes."""

    def __init__(self, file: str) -> None:
        self.files: list[str] = []
        self.root = self._read(file)
        self.file = file
        self.parents = {child: parent for parent in self.root.iter() for child in parent}

    def _read(self, file: str) -> ElementTree.Element:
        if file in self.files:
            raise InputError(file, "this MaterialX document includes itself")
        self.files.append(file)
        try:
            root = ElementTree.parse(file).getroot()
        except (ElementTree.ParseError, OSError, UnicodeDecodeError) as error:
            raise InputError(file, f"can't be read as a MaterialX document: {error}") from None
        if root.tag != "materialx":
            raise InputError(file, f"is no MaterialX document: its root is <{root.tag}>")
        folder = os.path.dirname(file)
        root.set("fileprefix", os.path.join(folder, root.get("fileprefix", "")))
        for include in root.findall(_INCLUDE):
            root.remove(include)
            inner = self._read(os.path.normpath(os.path.join(folder, include.get("href", ""))))
            for child in inner:
                for name in ("colorspace", "fileprefix"):
                    own = child.get(name)
                    if (outer := inner.get(name)) and not (own and name == "colorspace"):
                        child.set(name, outer + (own or "") if name == "fileprefix" else outer)
                root.append(child)
        return root

    def named(self, scope: ElementTree.Element, name: str | None) -> ElementTree.Element | None:
        """An element of a scope, else of the document."""
        for place in (scope, self.root):
            for child in place:
                if name and child.get("name") == name:
                    return child
        return None

    def inherited(self, element: ElementTree.Element, name: str) -> list[str]:
        """An attribute of an element and of those around it, from the outside in."""
        out: list[str] = []
        at: ElementTree.Element | None = element
        while at is not None:
            if (value := at.get(name)) is not None:
                out.insert(0, value)
            at = self.parents.get(at)
        return out


@dataclass(frozen=True)
class _Port:
    """What feeds an input: a node with an output, or an element with a value."""

    node: ElementTree.Element | None
    scope: ElementTree.Element
    output: str
    value: ElementTree.Element


class _Material:
    """One material in the making."""

    def __init__(self, stage: Usd.Stage, document: _Document, element: ElementTree.Element) -> None:
        self.stage, self.document, self.element = stage, document, element
        self.path = Sdf.Path("/MaterialX/Materials").AppendChild(Tf.MakeValidIdentifier(element.get("name", "material")))
        self.nodes: dict[ElementTree.Element, UsdShade.Shader] = {}

    def write(self) -> None:
        material = UsdShade.Material.Define(self.stage, self.path)
        for kind in _OUTPUTS[self.element.tag]:
            found = next((i for i in self.element.findall("input") if i.get("name") == f"{kind}shader"), None)
            port = None if found is None else self._port(found, self.document.root)
            if port is not None and port.node is not None:
                output = material.CreateOutput(f"mtlx:{kind}", Sdf.ValueTypeNames.Token)
                output.ConnectToSource(self._shader(port).CreateOutput(port.output, Sdf.ValueTypeNames.Token))
        # Nodes find their own inputs as they come.
        pending = list(self.nodes)
        while pending:
            node = pending.pop()
            before = len(self.nodes)
            self._inputs(node)
            pending += list(self.nodes)[before:]

    def _shader(self, port: _Port) -> UsdShade.Shader:
        node = port.node
        assert node is not None
        if node not in self.nodes:
            graph = "" if port.scope is self.document.root else f"{port.scope.get('name', '')}_"
            name = Tf.MakeValidIdentifier(graph + node.get("name", node.tag))
            shader = UsdShade.Shader.Define(self.stage, self.path.AppendChild(name))
            shader.CreateIdAttr(f"ND_{node.tag}_{node.get('type', '')}")
            self.nodes[node] = shader
        return self.nodes[node]

    def _inputs(self, node: ElementTree.Element) -> None:
        shader = self.nodes[node]
        for element in node.findall("input"):
            name, kind = element.get("name", ""), element.get("type", "")
            if not Sdf.Path.IsValidNamespacedIdentifier(name):
                raise InputError(self.document.file, f"the node '{node.get('name')}' has an input called '{name}'")
            port = self._port(element, self.document.parents[node])
            found = shader.CreateInput(name, _TYPES.get(kind, Sdf.ValueTypeNames.Token))
            if port is not None and port.node is not None:
                source = self._shader(port)
                found.ConnectToSource(source.CreateOutput(port.output, _TYPES.get(kind, Sdf.ValueTypeNames.Token)))
            elif port is not None and kind in _TYPES:
                self._value(found, kind, port.value)

    def _port(self, element: ElementTree.Element, scope: ElementTree.Element, depth: int = 0) -> _Port | None:
        """Follows an input through node graphs and their interfaces; None for one that nothing feeds."""
        if depth > MAX_DEPTH:
            raise InputError(self.document.file, f"'{element.get('name')}' is fed by itself")
        if (graph_name := element.get("nodegraph")) is not None:
            graph = self.document.named(self.document.root, graph_name)
            outputs = [] if graph is None else graph.findall("output")
            wanted = element.get("output")
            chosen = next((o for o in outputs if wanted in (None, o.get("name"))), None)
            if graph is None or chosen is None:
                raise InputError(self.document.file, f"'{element.get('name')}' names the output '{wanted}' of '{graph_name}', which is not there")
            return self._port(chosen, graph, depth + 1)
        if (node_name := element.get("nodename")) is not None:
            node = self.document.named(scope, node_name)
            if node is None:
                raise InputError(self.document.file, f"'{element.get('name')}' names the node '{node_name}', which is not there")
            parent = self.document.parents[node]
            if node.tag == "nodegraph":
                inner = ElementTree.Element("input", {"name": element.get("name", ""), "nodegraph": node_name})
                if (output := element.get("output")) is not None:
                    inner.set("output", output)
                return self._port(inner, scope, depth + 1)
            if node.tag == "input":
                return self._port(node, self.document.parents[parent] if parent in self.document.parents else parent, depth + 1)
            return _Port(node, parent, element.get("output") or "out", element)
        if (interface := element.get("interfacename")) is not None:
            inputs = [i for i in scope.findall("input") if i.get("name") == interface]
            return self._port(inputs[0], self.document.root, depth + 1) if inputs else None
        return _Port(None, scope, "", element) if element.get("value") is not None else None

    def _value(self, found: UsdShade.Input, kind: str, element: ElementTree.Element) -> None:
        """The constant of an input, as MaterialX writes it."""
        text = element.get("value", "")
        spaces = self.document.inherited(element, "colorspace")
        if kind == "filename":
            found.Set(Sdf.AssetPath(os.path.normpath("".join(self.document.inherited(element, "fileprefix")) + text)))
            if spaces:
                found.GetAttr().SetColorSpace(spaces[-1])
            return
        if kind == "string":
            found.Set(text)
            return
        try:
            if kind == "boolean":
                found.Set({"true": True, "false": False}[text.strip().lower()])
                return
            numbers = [float(x) for x in text.split(",")]
            if kind in ("float", "integer"):
                (number,) = numbers
                found.Set(number if kind == "float" else int(number))
                return
            if kind.startswith("color") and spaces and spaces[-1] in ("srgb_texture", "srgb"):
                numbers[:3] = [_linear(x) for x in numbers[:3]]
            if len(numbers) != int(kind[-1]):
                raise ValueError
            found.Set(_VECTORS[len(numbers)](*numbers))
        except (ValueError, KeyError, OverflowError):
            raise InputError(self.document.file, f"the input '{element.get('name')}' has the value '{text}', which is no {kind}") from None


def _linear(x: float) -> float:
    """The sRGB transfer function (IEC 61966-2-1), undone."""
    return x / 12.92 if x <= 0.04045 else ((x + 0.055) / 1.055) ** 2.4
