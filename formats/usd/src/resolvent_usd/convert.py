"""A stage to a scene: opening it, walking it, writing the result."""

from __future__ import annotations

import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from pxr import Sdf, Tf, Usd, UsdUtils

from . import converters, mtlx, render_settings
from .context import Context, Options
from .groups import lay_out
from .report import InputError, Report
from .traverse import Walk


def open_stage(path: str, options: Options, report: Report) -> Usd.Stage:
    """Opens a stage with its payloads and the chosen variants.

    What composition could not resolve is an error, or with --keep-going in the report.
    """
    with _diagnostics():
        try:
            stage = Usd.Stage.Open(path, Usd.Stage.LoadAll)
        except Tf.ErrorException as error:
            first = str(error).strip().splitlines()
            raise InputError(path, f"can't be opened as a USD stage: {first[-1].strip() if first else error}") from None
        stage.SetEditTarget(stage.GetSessionLayer())
        for prim_path, name, selection in options.variants:
            _select(stage, prim_path, name, selection)
        problems = mtlx.compose(stage)
    problems += [
        InputError(broken.rootSite.path, " ".join(str(broken).split()))
        for broken in stage.GetCompositionErrors()
        if not mtlx.known(broken)
    ]
    for problem in problems:
        if not options.keep_going:
            raise problem
        report.failed(problem)
    return stage


@contextmanager
def _diagnostics() -> Iterator[None]:
    """What could not be composed is ours to report; what else USD says goes to the terminal."""
    delegate = UsdUtils.CoalescingDiagnosticDelegate()
    try:
        yield
    finally:
        for said in delegate.TakeUncoalescedDiagnostics():
            if not said.sourceFunction.endswith("_ReportErrors"):
                print(f"USD: {said.commentary}", file=sys.stderr)


def _select(stage: Usd.Stage, prim_path: str, name: str, selection: str) -> None:
    prim = stage.GetPrimAtPath(prim_path) if Sdf.Path.IsValidPathString(prim_path) else None
    if not prim:
        raise InputError(prim_path, "--variant names a prim that the stage does not have")
    sets = prim.GetVariantSets()
    if name not in sets.GetNames():
        raise InputError(prim_path, f"has no variant set '{name}', only: {', '.join(sets.GetNames()) or 'none at all'}")
    if selection not in (known := sets.GetVariantSet(name).GetVariantNames()):
        raise InputError(prim_path, f"variant set '{name}' has no '{selection}', only: {', '.join(known)}")
    sets.SetSelection(name, selection)


def convert(stage: Usd.Stage, scene_file: Path, options: Options, report: Report) -> Context:
    """Converts a stage at one time and writes the scene; the report grows by what is lost."""
    ctx = Context(stage, options, scene_file, report)
    ctx.settings = render_settings.read(ctx)
    ctx.purposes = options.purposes or ctx.settings.purposes or ctx.purposes
    Walk(ctx).stage()
    converters.finish(ctx)
    lay_out(ctx.world, ctx.scene)
    for claim in ctx.claims:
        claim.finish()
    ctx.scene.units = {"meters_per_unit": ctx.meters_per_unit}
    ctx.scene.write(scene_file)
    return ctx
