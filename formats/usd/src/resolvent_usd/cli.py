"""The command usd2resolvent.

Exit codes: 0 done, 2 wrong usage or input (with --strict also a loss), 1 anything else.
"""

from __future__ import annotations

import argparse
import hashlib
import json
import re
import sys
from collections.abc import Sequence
from pathlib import Path

from pxr import Ar, Sdf, Usd

from . import mtlx
from .context import Options
from .convert import convert, open_stage
from .report import InputError, Report


def _variant(text: str) -> tuple[str, str, str]:
    match = re.fullmatch(r"(/[^{}]*)\{([^={}]+)=([^={}]*)\}", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form /Prim{{set=selection}}")
    return match[1], match[2], match[3]


def _frames(text: str) -> list[float]:
    """Time codes of "first-last" or "first-last:step"."""
    number = r"(-?\d+(?:\.\d+)?)"
    match = re.fullmatch(rf"{number}-{number}(?::{number})?", text)
    if not match:
        raise argparse.ArgumentTypeError(f"'{text}' is not of the form first-last or first-last:step, as 1-100:2")
    first, last, step = float(match[1]), float(match[2]), float(match[3] or 1)
    if step <= 0 or last < first:
        raise argparse.ArgumentTypeError(f"'{text}' has no frames")
    count = int((last - first) / step + 1e-9) + 1
    if count > 1_000_000:
        raise argparse.ArgumentTypeError(f"'{text}' has {count} frames")
    return [first + i * step for i in range(count)]


def _prim_path(text: str) -> str:
    if not Sdf.Path.IsValidPathString(text) or not text.startswith("/"):
        raise argparse.ArgumentTypeError(f"'{text}' is no prim path, as /World/camera")
    return text


def parser() -> argparse.ArgumentParser:
    """All flags, with their help."""
    p = argparse.ArgumentParser(prog="usd2resolvent", description="Converts a USD stage to a Resolvent scene.")
    p.add_argument("stage", help="the stage (.usd, .usda, .usdc, .usdz)")
    p.add_argument("-o", "--output", required=True, type=Path, metavar="SCENE.json", help="the scene to write")
    time = p.add_mutually_exclusive_group()
    time.add_argument("--frame", type=float, metavar="T", help="time code (the stage's start)")
    time.add_argument(
        "--frames", type=_frames, metavar="A-B:S", help="a sequence: one scene each, #### in the output or .0001 before its suffix"
    )
    p.add_argument(
        "--variant", type=_variant, action="append", default=[], metavar="/PRIM{SET=SEL}", help="selects a variant; may be repeated"
    )
    p.add_argument("--purpose", metavar="LIST", help="purposes that are drawn (the render settings', else default,render)")
    p.add_argument("--camera", type=_prim_path, metavar="/PRIM", help="the camera (that of the render settings, else the first)")
    p.add_argument("--render-settings", type=_prim_path, metavar="/PRIM", help="the RenderSettings prim (the stage's own)")
    p.add_argument("--subdivision", type=int, default=2, metavar="N", choices=range(7), help="level of subdivision surfaces (2)")
    p.add_argument("--report", type=Path, metavar="FILE.json", help="writes all losses as JSON")
    p.add_argument("--layers", type=Path, metavar="FILE.json", help="writes the files of all layers that were read, with hashes of them")
    p.add_argument("--strict", action="store_true", help="any loss is an error")
    p.add_argument("--keep-going", action="store_true", help="leaves out prims with errors and converts the rest")
    return p


def scene_files(output: Path, frames: Sequence[float | None]) -> list[Path]:
    """Where the scene of each frame goes."""
    if frames == [None]:
        return [output]
    pattern = output.name
    if not re.search("#+", pattern):
        pattern = f"{output.stem}.####{output.suffix}"

    def name(frame: float) -> str:
        whole, _, part = f"{round(frame, 6):.12g}".partition(".")
        number = lambda m: whole.zfill(len(m[0])) + ("." + part if part else "")  # noqa: E731
        return re.sub("#+", number, pattern, count=1)

    return [output.with_name(name(frame or 0.0)) for frame in frames]


def layer_hashes(stage: Usd.Stage) -> dict[str, str]:
    """BLAKE2b (16 bytes) of the files that the stage is composed of; packages count as a whole."""
    paths = {Ar.SplitPackageRelativePathOuter(layer.realPath)[0] for layer in stage.GetUsedLayers() if layer.realPath}
    paths |= mtlx.sources(stage)
    return {path: hashlib.blake2b(Path(path).read_bytes(), digest_size=16).hexdigest() for path in sorted(paths)}


def run(arguments: argparse.Namespace) -> int:
    """Converts as the flags say."""
    purposes = None
    if arguments.purpose is not None:
        purposes = tuple(word.strip() for word in arguments.purpose.split(",") if word.strip())
    frames: list[float | None] = list(arguments.frames or [arguments.frame])
    outputs = scene_files(arguments.output, frames if arguments.frames else [None])
    report = Report()
    stage = None
    for frame, output in zip(frames, outputs, strict=True):
        options = Options(
            frame=frame,
            purposes=purposes,
            variants=tuple(arguments.variant),
            camera=arguments.camera,
            render_settings=arguments.render_settings,
            subdivision=arguments.subdivision,
            keep_going=arguments.keep_going,
        )
        stage = stage or open_stage(arguments.stage, options, report)
        convert(stage, output, options, report)
        print(output)
    if arguments.report:
        arguments.report.write_text(json.dumps(report.to_json(), indent=1), encoding="utf-8")
    if arguments.layers and stage:
        arguments.layers.write_text(json.dumps(layer_hashes(stage), indent=1), encoding="utf-8")
    for line in report.summary():
        print(line, file=sys.stderr)
    if arguments.strict and report.losses:
        print(f"{len(report.losses)} losses, and --strict allows none", file=sys.stderr)
        return 2
    return 0


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of the command."""
    arguments = parser().parse_args(argv)
    try:
        return run(arguments)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1


if __name__ == "__main__":
    sys.exit(main())
