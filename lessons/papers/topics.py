"""The disagreements with the papers: the difference, our evidence, the likely cause, and a run that shows
it."""

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
"""By item and quantity: our number, and its ratio to the paper's."""


@dataclass(frozen=True)
class Quoted:
    """A measured number in a topic's texts.

    Attributes:
        item, row: name of an item, and the quantity of one of its rows.
        ratio: whether the text contains the ratio of our number to the paper's, instead of our number.
        less: number to subtract, e.g. 1, which turns a ratio into a change.
        scale: factor for the unit of the text, applied after the subtraction.
        form: a Python format.
    """

    item: str
    row: str
    ratio: bool = False
    less: float = 0.0
    scale: float = 1.0
    form: str = ".2g"

    def words(self, measured: Measured) -> str:
        """Returns the number as the text contains it; "–" if it was not measured."""
        ours, ratio = measured.get((self.item, self.row), (math.nan, None))
        value = ratio if self.ratio else ours
        if value is None or not math.isfinite(value):
            return "–"
        written = format((value - self.less) * self.scale, self.form)
        return written.replace("-", "−").replace("%", " %")


@dataclass(frozen=True)
class Topic:
    """One disagreement, or several with the same cause.

    Attributes:
        name: the key that rows refer to.
        title: one line.
        evidence: text about our measurements; a {name} is replaced by that number of `numbers`.
        cause: text about the most likely cause; names are replaced here, too.
        look: text that says how to see the difference.
        scene, set: the setting that shows the disagreement; "" for none.
        numbers: the measured numbers, by name.
        given: the numbers in the texts that are not measured, but given by a paper or a setting.
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

    def with_numbers(self, measured: Measured) -> Topic:
        """Returns the topic with the measured numbers in its texts."""
        words = {name: quoted.words(measured) for name, quoted in self.numbers.items()}
        return replace(self, evidence=self.evidence.format_map(words), cause=self.cause.format_map(words))

    @property
    def state(self) -> State | None:
        """The setting that shows the disagreement."""
        return State(RunSpec(self.scene, set=self.set)) if self.scene else None


@cache
def topics() -> dict[str, Topic]:
    """Returns all topics by name, in the order of the file."""
    text = Path(__file__).with_name("topics.toml").read_text(encoding="utf-8")
    return {name: _topic(name, entry) for name, entry in tomllib.loads(text).items()}


def _topic(name: str, data: dict[str, Any]) -> Topic:
    return Topic(
        name,
        title=data["title"],
        evidence=data["evidence"],
        cause=data["cause"],
        look=data["look"],
        scene=data.get("scene", ""),
        set=tuple(data.get("set", ())),
        numbers={key: Quoted(**entry) for key, entry in data.get("numbers", {}).items()},
        given=tuple(data.get("given", ())),
    )
