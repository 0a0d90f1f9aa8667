"""What a conversion lost: every prim, attribute or shader that has not its full effect in the scene.

A :class:`Loss` is reported where it is found; nothing is dropped without one. What a stage asks not to see (a purpose
that is not drawn, invisible prims) is no loss but a note.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import asdict, dataclass, field
from typing import Any, Literal

Kind = Literal["skipped", "approximated", "failed"]


class InputError(Exception):
    """Input that has no meaning: ends the conversion with exit code 2, or with --keep-going the prim's."""

    def __init__(self, path: object, message: str) -> None:
        super().__init__(f"{path}: {message}")
        self.path = str(path)
        self.message = message


@dataclass(frozen=True)
class Loss:
    """One thing without its full effect."""

    path: str
    """The prim's path."""
    what: str
    """The attribute, schema or shader; empty for the whole prim."""
    kind: Kind
    """Left out, shown by something similar, or (with --keep-going) in error."""
    reason: str
    consequence: str
    """What is different in the picture."""


@dataclass
class Report:
    """All losses and notes of one conversion."""

    losses: list[Loss] = field(default_factory=list)
    notes: list[dict[str, str]] = field(default_factory=list)
    _seen: set[Loss] = field(default_factory=set)

    def add(self, path: object, what: str, kind: Kind, reason: str, consequence: str) -> None:
        """Reports a loss, once."""
        loss = Loss(str(path), what, kind, reason, consequence)
        if loss not in self._seen:
            self._seen.add(loss)
            self.losses.append(loss)

    def skipped(self, path: object, what: str, reason: str, consequence: str) -> None:
        self.add(path, what, "skipped", reason, consequence)

    def approximated(self, path: object, what: str, reason: str, consequence: str) -> None:
        self.add(path, what, "approximated", reason, consequence)

    def failed(self, error: InputError) -> None:
        """With --keep-going: an error's prim is missing."""
        self.add(error.path, "", "failed", error.message, "missing in the scene")

    def note(self, path: object, text: str) -> None:
        """Something left out because the stage or the command line says so, or because nothing asks for it."""
        self.notes.append({"path": str(path), "note": text})

    def to_json(self) -> dict[str, Any]:
        return {"losses": [asdict(loss) for loss in self.losses], "notes": self.notes}

    def summary(self, limit: int = 20) -> Iterator[str]:
        """Lines for the terminal: losses of one sort together, at most ``limit`` sorts."""
        sorts: dict[tuple[str, str, str, str], list[str]] = {}
        for loss in self.losses:
            key = (loss.kind, loss.what, loss.reason, loss.consequence)
            sorts.setdefault(key, []).append(loss.path)
        order = {"failed": 0, "skipped": 1, "approximated": 2}
        ranked = sorted(sorts.items(), key=lambda item: order[item[0][0]])
        for (kind, what, reason, consequence), paths in ranked[:limit]:
            place = paths[0] if len(paths) == 1 else f"{paths[0]} and {len(paths) - 1} more"
            subject = f"{place} {what}".rstrip()
            yield f"{kind}: {subject}: {reason}; {consequence}"
        if len(ranked) > limit:
            yield f"… and {len(ranked) - limit} more sorts of losses (--report FILE.json lists all)"
        if self.notes:
            yield f"{len(self.notes)} notes on what was left out with reason (--report FILE.json lists them)"
