"""Writes that come too late: a page may be built anew while a callback of one of its controls still runs."""

from __future__ import annotations

_LATE = " on a removed "


def too_late(error: BaseException) -> bool:
    """Whether an exception is viser's refusal of a write to a control or node that was removed. Nobody
    sees it any more, so nothing is missed."""
    return isinstance(error, RuntimeError) and _LATE in str(error)
