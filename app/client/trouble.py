"""The problem that a page shows, with a button, when its simulation does not run correctly."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from app.link.forkserver import FIRST_PATIENCE
from app.link.process import Process

SILENCE = 3.0
"""Time without a report, s, after which a page shows this problem. A simulation reports ten times per
second."""
DEADLINE = 30.0
"""Largest time for loading a scene, s."""


@dataclass(frozen=True)
class Trouble:
    """state: a word for the badge; sentence: the problem; offer: label of the button that starts the scene
    again; None if the learner can only wait."""

    state: Literal["STOPPED", "SILENT", "LOADING", "PREPARING", "YOUR CODE", "YOUR LESSON"]
    sentence: str
    offer: str | None = "Start again"


def trouble_of(process: Process, loading: bool, quiet: float, who: str = "The simulation") -> Trouble | None:
    """Returns the problem of a process that has not failed; None if there is no problem.

    Args:
        process: the process.
        loading: whether its last report says that it loads a scene.
        quiet: time since its last report, s.
        who: the first words of the sentence.
    """
    doing = process.preparing
    if quiet < SILENCE and not doing:
        return None
    waited = f"{quiet:.0f} s"
    if doing is not None:
        what = f": {doing}" if doing else ""
        late = quiet > FIRST_PATIENCE
        return Trouble(
            "PREPARING", f"The simulations are being prepared{what}. {waited} …", *(() if late else (None,))
        )
    if not loading:
        why = "this computer is too busy, or the simulation hangs"
        return Trouble("SILENT", f"{who} has not reported anything for {waited}: {why}.")
    if quiet < DEADLINE:
        return Trouble("LOADING", f"{who} is being loaded: {waited} of at most {DEADLINE:.0f} s.", "Cancel")
    why = "this computer is too busy, or the scene is too large"
    return Trouble("SILENT", f"{who} could not be loaded within {DEADLINE:.0f} s: {why} ({waited}).")
