"""What a page is told about a controller from the learner's own file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnCode:
    """The controller is a file of one's own.

    Attributes:
        file: its path.
        fault: one sentence if it does not run as it is.
        saves: how often a saved text took over.
        at: s, when the last one did.
    """

    file: str
    fault: str | None
    saves: int
    at: float
