"""What a page is told about a controller from the learner's own file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnCode:
    """The state of a controller from the user's own file.

    Attributes:
        file: its path.
        fault: one sentence if it does not run as it is.
        saves: number of times that a saved text took effect.
        at: simulated time of the last one, s.
    """

    file: str
    fault: str | None
    saves: int
    at: float
