"""Where we disagree with the papers: what differs, our evidence, the likely cause, how to see it live."""

from __future__ import annotations

import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from lessons.replay.state import State
from lessons.scenes.run_spec import RunSpec


@dataclass(frozen=True)
class Topic:
    """One disagreement, or several of one cause.

    Attributes:
        name: the key that rows refer to.
        title: one line.
        evidence: what we measured.
        cause: what most likely makes the difference.
        look: what to do and see.
        scene, set: the setting that shows it; "" for none.
    """

    name: str
    title: str
    evidence: str
    cause: str
    look: str
    scene: str = ""
    set: tuple[str, ...] = ()

    @property
    def state(self) -> State | None:
        """The setting that shows it."""
        return State(RunSpec(self.scene, set=self.set)) if self.scene else None


@cache
def topics() -> dict[str, Topic]:
    """All of them by name, in the file's order."""
    text = Path(__file__).with_name("topics.toml").read_text(encoding="utf-8")
    return {
        name: Topic(name, **{**each, "set": tuple(each.get("set", ()))})
        for name, each in tomllib.loads(text).items()
    }
