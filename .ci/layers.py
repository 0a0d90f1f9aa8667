#!/usr/bin/env python3
"""Checks that dependencies between the workspace's crates point one way.

cli -> engine -> pathspace -> api <- plugins; formats know neither the engine nor plugins; no plugin knows another;
api depends on glam and bytemuck at most.
"""
import json
import subprocess
import sys

metadata = json.loads(subprocess.run(
    ["cargo", "metadata", "--format-version", "1", "--no-deps"], check=True, capture_output=True, text=True).stdout)
packages = {p["name"]: p for p in metadata["packages"]}


def layer(name):
    """The room of the house a crate stands in."""
    path = packages[name]["manifest_path"].removeprefix(metadata["workspace_root"] + "/").split("/")
    nested = path[0] in ("core", "plugins", "formats") or path[:2] == ["tests", "bench"]
    return "/".join(path[:2]) if nested else path[0]


# What a crate of each layer may use of ours, outside its tests.
ALLOWED = {
    "core/api": set(),
    "core/pathspace": {"core/api"},
    # What a plugin is checked with needs no more than the plugin itself.
    "core/conformance": {"core/api"},
    "core/engine": {"core/api", "core/pathspace", "formats/scene", "formats/image", "formats/ply", "formats/gltf"},
    "cli": {"core/api", "core/conformance", "core/engine", "formats/scene", "formats/image", "formats/vdb", "formats/gltf",
            "tests/bench"},
    # The benchmark runs the program from outside, like its peers.
    "tests/bench": {"formats/image", "formats/vdb"},
    "plugins/media": {"core/api", "formats/vdb"},
    "plugins/phases": {"core/api"},
    "plugins/bsdfs": {"core/api"},
    "plugins/integrators": {"core/api", "core/pathspace"},
    "formats/vdb": set(), "formats/scene": set(), "formats/image": set(), "formats/ply": set(),
    # Models become parts of scenes.
    "formats/gltf": {"formats/scene"},
    "tests": {"tests/bench", "core/api", "core/conformance", "core/pathspace", "core/engine", "formats/scene", "formats/image", "formats/vdb"},
}
faults = []
for name, package in packages.items():
    here = layer(name)
    if here not in ALLOWED:
        faults.append(f"{name}: no rule for {here}")
        continue
    for dependency in package["dependencies"]:
        other = dependency["name"]
        if other not in packages:
            if here == "core/api" and dependency["kind"] is None and other not in ("glam", "bytemuck"):
                faults.append(f"{name} uses {other}: the api depends on glam and bytemuck at most")
            continue
        test_only = dependency["kind"] == "dev" and layer(other) == "tests"
        if layer(other) not in ALLOWED[here] and not test_only:
            faults.append(f"{name} ({here}) must not use {other} ({layer(other)})")
print("\n".join(faults) or f"{len(packages)} crates, dependencies point one way")
sys.exit(bool(faults))
