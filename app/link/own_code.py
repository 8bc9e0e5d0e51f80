"""The state of a controller from the user's own file, as the simulation reports it to the page."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class OwnCode:
    """The state of a controller from the user's own file.

    Attributes:
        file: path of the file.
        fault: one sentence if the present content of the file cannot run.
        saves: number of saved versions that took effect.
        at: simulated time at which the last saved version took effect, s.
    """

    file: str
    fault: str | None
    saves: int
    at: float
