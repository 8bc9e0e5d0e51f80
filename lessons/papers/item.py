"""A table or figure of a paper: the runs it needs and what is made of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

from lessons.experiments.jobs import Results, Work
from lessons.plots.panels import Picture

CLOSE = 0.10
"""Ours and the paper's agree if their ratio is within this of 1: neither plant nor model error is printed, so
that nothing closer could be expected of a reading."""

TIE = 0.02
"""An effect that is closer than this to its turning point counts as no effect."""

Verdict = Literal["agrees", "differs", "opposite", "no number", ""]
Side = Literal["below", "above", "about"]


@dataclass(frozen=True)
class Row:
    """One number of a paper beside ours.

    Attributes:
        quantity: what it is; no two rows of an item have the same.
        unit: of both.
        paper: the printed value; None: the paper prints none.
        ours: the measured one; NaN: there is none.
        why: one sentence for the reader if the two differ, or if there is none to compare.
        turns_at: for an effect, where it turns into its opposite: 1 for a ratio, 0 for a difference.
        says: where the paper prints no number but says on which side of `turns_at` it is.
        within: ours and the paper's agree if their ratio is within this of 1.
        band: how far ours may be from the stored number, as a share; a machine's times need a wide one.
        topic: the disagreement (`lessons.papers.topics`) that explains it, if the two do not agree.
        copied: ours is a setting taken over from the paper, no measurement.
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
        """Ours over the paper's."""
        if self.paper is None or not math.isfinite(self.ours) or self.paper == 0:
            return None
        return self.ours / self.paper

    @property
    def verdict(self) -> Verdict:
        """The verdict on our number against the paper's; "" if the paper neither prints nor says anything."""
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
            return "differs"  # the paper sees an effect where ours has none
        return "agrees" if (self.ours < turn) == (self.says == "below") else "opposite"

    def _turned(self) -> bool:
        """Whether an effect is the other way round; one that is none, here or there, cannot be."""
        if self.turns_at is None or self.paper is None:
            return False
        theirs, own = self.paper - self.turns_at, self.ours - self.turns_at
        return theirs * own < 0 and min(abs(theirs), abs(own)) > TIE * abs(self.turns_at)

    @property
    def remark(self) -> str:
        """`why`, unless ours and the paper's agree."""
        if self.verdict == "agrees" and self.says is None:
            return (
                f"agrees within {self.within:.4g}"
                if self.within < 0.01
                else f"agrees within {self.within:.0%}"
            )
        return self.why


@dataclass(frozen=True)
class Table:
    """A table beside the paper's rows: more of ours, or verdicts."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class PaperCheck:
    """A measurable sentence, the number it is about, and whether it holds.

    Attributes:
        text: the sentence; no two checks of an item have the same.
        value: the number.
        holds: whether it is so.
        band: how far the number may be from the stored one, as a share; None: it may be anything that holds.
    """

    text: str
    value: float
    holds: bool
    band: float | None = CLOSE


@dataclass(frozen=True)
class Section:
    """What an item reports.

    Attributes:
        notes: paragraphs before the tables: how it was run, what the paper leaves open.
        rows: the paper's numbers beside ours.
        tables: further tables.
        checks: what must hold; one that does not makes the command's exit code 1.
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
        jobs: the runs it needs; the argument asks for the quick version.
        report: the section made of them. A failed run must not stop it: its figures are NaN.
    """

    name: str
    title: str
    source: str
    jobs: Callable[[bool], tuple[Work, ...]]
    report: Callable[[Results, bool], Section]


def at_most(text: str, value: float, limit: float, band: float | None = CLOSE) -> PaperCheck:
    """The check that a value is at most a limit; NaN is not."""
    return PaperCheck(f"{text} ≤ {limit:g}", value, bool(value <= limit), band)


def between(text: str, value: float, low: float, high: float, band: float | None = CLOSE) -> PaperCheck:
    """The check that a value is within two limits; NaN is not."""
    return PaperCheck(f"{text}, {low:g} to {high:g}", value, bool(low <= value <= high), band)
