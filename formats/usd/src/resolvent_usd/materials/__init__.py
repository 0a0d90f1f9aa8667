"""Materials of surfaces."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from ..claim import Claim
    from ..context import Context, Look


def material_for(ctx: Context, claim: Claim, subset: Claim | None) -> Look | None:
    """See :meth:`Context.material_for`."""
    return None
