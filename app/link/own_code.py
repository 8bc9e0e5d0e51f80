"""The state of a controller from the learner's own file, as the simulation reports it to the page."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnCode:
    """The state of a controller from the user's own file.

    Attributes:
        file: its path.
        fault: one sentence if the file as it is now cannot run.
        saves: number of times that a saved version took effect.
        at: simulated time at which the last saved version took effect, s.
    """

    file: str
    fault: str | None
    saves: int
    at: float
