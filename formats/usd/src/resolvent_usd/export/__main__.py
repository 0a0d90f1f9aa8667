"""The command ``python -m resolvent_usd.export``.

Exit codes as those of usd2resolvent.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Sequence
from pathlib import Path

from ..report import InputError, Report
from . import export


def main(argv: Sequence[str] | None = None) -> int:
    """Entry point of the command."""
    p = argparse.ArgumentParser(prog="resolvent_usd.export", description="Writes a Resolvent scene as a USD stage.")
    p.add_argument("scene", type=Path, help="the scene (.json)")
    p.add_argument("-o", "--output", required=True, type=Path, metavar="STAGE.usda", help="the stage to write (.usda, .usdc, .usd)")
    p.add_argument("--report", type=Path, metavar="FILE.json", help="writes all losses as JSON")
    p.add_argument("--strict", action="store_true", help="any loss is an error")
    arguments = p.parse_args(argv)
    report = Report()
    try:
        export(arguments.scene, arguments.output, report)
    except InputError as error:
        print(f"error: {error}", file=sys.stderr)
        return 2
    except OSError as error:
        print(f"error: {error}", file=sys.stderr)
        return 1
    print(arguments.output)
    if arguments.report:
        arguments.report.write_text(json.dumps(report.to_json(), indent=1), encoding="utf-8")
    for line in report.summary():
        print(line, file=sys.stderr)
    return 2 if arguments.strict and report.losses else 0


if __name__ == "__main__":
    sys.exit(main())
