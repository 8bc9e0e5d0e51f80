"""A table or figure of a paper: the runs that it needs and the section that reports them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lessons.experiments.jobs import Results, Work
from lessons.plots.panels import Picture

CLOSE = 0.10
"""Our number and the paper's agree if their ratio differs from 1 by at most this. The papers print neither
plant nor model error, so that a closer agreement cannot be expected."""

TIE = 0.02
"""An effect whose relative distance from its turning point is smaller than this counts as no effect."""

Verdict = Literal["agrees", "differs", "opposite", "no number", ""]
Side = Literal["below", "above", "about"]


@dataclass(frozen=True)
class Row:
    """One number of a paper beside ours.

    Attributes:
        quantity: name of the quantity; it is unique within an item.
        unit: unit of both numbers.
        paper: the printed value; None: the paper prints none.
        ours: the measured value; NaN: there is none.
        why: one sentence with the cause if the two numbers differ, or if there is no printed number.
        turns_at: for an effect, the value at which it turns into its opposite: 1 for a ratio, 0 for a
            difference.
        says: the side of `turns_at` that the paper states, if the paper prints no number.
        within: the two numbers agree if their ratio differs from 1 by at most this.
        band: largest deviation from the stored number, as a share; times need a wide band.
        topic: if the two do not agree, the disagreement of `lessons.papers.topics` that explains the
            difference.
        copied: whether our number is a setting taken from the paper, and not a measurement.
    """

    quantity: str
    unit: str
    paper: float | None
    ours: float
    why: str = ""
    turns_at: float | None = None
    says: Side | None = None
    within: float = CLOSE
    band: float = CLOSE
    topic: str = ""
    copied: bool = False

    @property
    def ratio(self) -> float | None:
        """The ratio of our number to the paper's."""
        if self.paper is None or not math.isfinite(self.ours) or self.paper == 0:
            return None
        return self.ours / self.paper

    @property
    def verdict(self) -> Verdict:
        """The verdict on our number against the paper's; "" if the paper neither prints the number nor
        describes it in words."""
        if self.paper is None and self.says is None:
            return ""
        if not math.isfinite(self.ours):
            return "no number"
        if self.says is not None:
            return self._verdict_on_a_side()
        close = self.ratio is not None and abs(self.ratio - 1.0) <= self.within
        if close or self.paper == self.ours:
            return "agrees"
        return "opposite" if self._turned() else "differs"

    def _verdict_on_a_side(self) -> Verdict:
        turn = self.turns_at if self.turns_at is not None else 1.0
        if self.says == "about":
            return "agrees" if abs(self.ours - turn) <= self.within * (abs(turn) or 1.0) else "differs"
        if abs(self.ours - turn) <= TIE * (abs(turn) or 1.0):
            return "differs"  # the paper reports an effect, and ours has none
        return "agrees" if (self.ours < turn) == (self.says == "below") else "opposite"

    def _turned(self) -> bool:
        """Returns whether our effect has the opposite direction; False if one of the two counts as no
        effect."""
        if self.turns_at is None or self.paper is None:
            return False
        theirs, own = self.paper - self.turns_at, self.ours - self.turns_at
        return theirs * own < 0 and min(abs(theirs), abs(own)) > TIE * abs(self.turns_at)

    @property
    def remark(self) -> str:
        """A text that says how well the two numbers agree. It is `why` if they do not agree, or if the paper
        states only a direction."""
        if self.verdict == "agrees" and self.says is None:
            return (
                f"agrees within {self.within:.4g}"
                if self.within < 0.01
                else f"agrees within {self.within:.0%}"
            )
        return self.why


@dataclass(frozen=True)
class Table:
    """A further table of an item: more numbers of ours, or verdicts."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class PaperCheck:
    """A statement, the number that decides it, and whether it holds.

    Attributes:
        text: the statement; it is unique within an item.
        value: the number.
        holds: whether the statement holds.
        band: largest deviation from the stored number, as a share; None: every number that holds is allowed.
    """

    text: str
    value: float
    holds: bool
    band: float | None = CLOSE


@dataclass(frozen=True)
class Section:
    """What an item reports.

    Attributes:
        notes: paragraphs before the tables: the settings of the runs, and data that the paper does not print.
        rows: the paper's numbers beside ours.
        tables: further tables.
        checks: statements that must hold; if one does not hold, the command's exit code is 1.
        pictures: plots.
    """

    notes: tuple[str, ...] = ()
    rows: tuple[Row, ...] = ()
    tables: tuple[Table, ...] = ()
    checks: tuple[PaperCheck, ...] = ()
    pictures: tuple[Picture, ...] = ()


@dataclass(frozen=True)
class Item:
    """A table or figure that can be reproduced.

    Attributes:
        name: e.g. "himpc-table-2".
        title: one line.
        source: paper and section.
        jobs: returns the runs of the item; the argument is true for the quick version.
        report: returns the section with the results of these runs. The figures of a failed run are NaN.
    """

    name: str
    title: str
    source: str
    jobs: Callable[[bool], tuple[Work, ...]]
    report: Callable[[Results, bool], Section]


def at_most(text: str, value: float, limit: float, band: float | None = CLOSE) -> PaperCheck:
    """Returns the check that a value is at most a limit; it fails for NaN."""
    return PaperCheck(f"{text} ≤ {limit:g}", value, bool(value <= limit), band)


def between(text: str, value: float, low: float, high: float, band: float | None = CLOSE) -> PaperCheck:
    """Returns the check that a value is within two limits; it fails for NaN."""
    return PaperCheck(f"{text}, {low:g} to {high:g}", value, bool(low <= value <= high), band)
