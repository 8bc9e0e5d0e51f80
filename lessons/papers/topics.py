"""Where we disagree with the papers: what differs, our evidence, the likely cause, how to see it live."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any

from lessons.replay.state import State
from lessons.scenes.run_spec import RunSpec

Measured = Mapping[tuple[str, str], tuple[float, float | None]]
"""By item and quantity: ours, and its ratio to the paper's."""


@dataclass(frozen=True)
class Quoted:
    """A measured number in a topic's texts.

    Attributes:
        item, row: whose, a quantity of the item's rows.
        ratio: ours over the paper's instead of ours.
        less: what is taken from it: 1 turns a ratio into a change.
        scale: what that is multiplied by, for the unit of the text.
        form: how it is written, a format of Python.
    """

    item: str
    row: str
    ratio: bool = False
    less: float = 0.0
    scale: float = 1.0
    form: str = ".2g"

    def words(self, measured: Measured) -> str:
        """As it stands in the text; "–" for none."""
        ours, ratio = measured.get((self.item, self.row), (math.nan, None))
        value = ratio if self.ratio else ours
        if value is None or not math.isfinite(value):
            return "–"
        written = format((value - self.less) * self.scale, self.form)
        return written.replace("-", "−").replace("%", " %")


@dataclass(frozen=True)
class Topic:
    """One disagreement, or several of one cause.

    Attributes:
        name: the key that rows refer to.
        title: one line.
        evidence: what we measured; {names} stand for `numbers`.
        cause: what most likely makes the difference; so here.
        look: what to do and see.
        scene, set: the setting that shows it; "" for none.
        numbers: what is measured, by name.
        given: the numbers in the texts that are not: a paper's, a setting's.
    """

    name: str
    title: str
    evidence: str
    cause: str
    look: str
    scene: str = ""
    set: tuple[str, ...] = ()
    numbers: Mapping[str, Quoted] = field(default_factory=dict)
    given: tuple[str, ...] = ()

    def told(self, measured: Measured) -> Topic:
        """With the measured numbers in its texts."""
        words = {name: each.words(measured) for name, each in self.numbers.items()}
        return replace(self, evidence=self.evidence.format_map(words), cause=self.cause.format_map(words))

    @property
    def state(self) -> State | None:
        """The setting that shows it."""
        return State(RunSpec(self.scene, set=self.set)) if self.scene else None


@cache
def topics() -> dict[str, Topic]:
    """All of them by name, in the file's order."""
    text = Path(__file__).with_name("topics.toml").read_text(encoding="utf-8")
    return {name: _topic(name, each) for name, each in tomllib.loads(text).items()}


def _topic(name: str, data: dict[str, Any]) -> Topic:
    return Topic(
        name,
        title=data["title"],
        evidence=data["evidence"],
        cause=data["cause"],
        look=data["look"],
        scene=data.get("scene", ""),
        set=tuple(data.get("set", ())),
        numbers={key: Quoted(**each) for key, each in data.get("numbers", {}).items()},
        given=tuple(data.get("given", ())),
    )
