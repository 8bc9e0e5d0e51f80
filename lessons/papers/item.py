"""A table or figure of a paper: the runs it needs and what is made of them."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

from lessons.experiments.jobs import Job, Results
from lessons.plots.panels import Picture

CLOSE = 0.10
"""Ours and the paper's agree if their ratio is within this of 1."""


@dataclass(frozen=True)
class Row:
    """One number of a paper beside ours.

    Attributes:
        quantity: what it is.
        unit: of both.
        paper: the printed value; None: the paper prints none.
        ours: the measured one; NaN: there is none.
        why: one sentence for the reader if the two differ, or if there is none to compare.
    """

    quantity: str
    unit: str
    paper: float | None
    ours: float
    why: str = ""

    @property
    def ratio(self) -> float | None:
        """Ours over the paper's."""
        if self.paper is None or not math.isfinite(self.ours) or self.paper == 0:
            return None
        return self.ours / self.paper

    @property
    def remark(self) -> str:
        """`why`, unless ours and the paper's agree."""
        close = self.ratio is not None and abs(self.ratio - 1.0) <= CLOSE
        return f"agrees within {CLOSE:.0%}" if close else self.why


@dataclass(frozen=True)
class Table:
    """A table beside the paper's rows: more of ours, or verdicts."""

    title: str
    columns: tuple[str, ...]
    rows: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Check:
    """A measurable sentence, the number it is about, and whether it holds."""

    text: str
    value: float
    holds: bool


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
    checks: tuple[Check, ...] = ()
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
    jobs: Callable[[bool], tuple[Job, ...]]
    report: Callable[[Results, bool], Section]


def at_most(text: str, value: float, limit: float) -> Check:
    """The check that a value is at most a limit; NaN is not."""
    return Check(f"{text} ≤ {limit:g}", value, bool(value <= limit))


def at_least(text: str, value: float, limit: float) -> Check:
    """The check that a value is at least a limit; NaN is not."""
    return Check(f"{text} ≥ {limit:g}", value, bool(value >= limit))
