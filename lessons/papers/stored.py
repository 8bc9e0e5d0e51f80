"""The stored measurements. New measurements are compared with the stored ones, which are shown if nothing is
run.

`stored.json` holds, for the whole and for the quick version, the rows and checks of every item as they were
measured at the last review. Written by `himpc-lab reproduce --store`.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from lessons.experiments.jobs import JobResult
from lessons.outputs import write_files
from lessons.papers.item import Item, PaperCheck, Row, Section
from lessons.papers.topics import topics

FILE = Path(__file__).with_name("stored.json")
_DIGITS = 6


@dataclass(frozen=True)
class StoredItem:
    """The stored numbers of one item.

    Attributes:
        rows: by quantity: (ours, ratio or None, verdict, the side that the paper says or None).
        checks: by text: (the value, whether it held).
    """

    rows: Mapping[str, tuple[float, float | None, str, str | None]]
    checks: Mapping[str, tuple[float, bool]]


def stored(quick: bool) -> dict[str, StoredItem]:
    """Returns the stored numbers by item; items that were never stored are missing."""
    data = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    return {
        item: StoredItem(
            {quantity: (_number(ours), *rest) for quantity, (ours, *rest) in kept["rows"].items()},
            {text: (_number(value), held) for text, (value, held) in kept["checks"].items()},
        )
        for item, kept in data.get(_version(quick), {}).items()
    }


def _version(quick: bool) -> str:
    return "quick" if quick else "whole"


def _number(value: float | None) -> float:
    return math.nan if value is None else float(value)


def store(sections: Mapping[str, Section], quick: bool) -> None:
    """Stores the measured numbers of some items; the stored numbers of other items do not change."""
    data: dict[str, Any] = json.loads(FILE.read_text(encoding="utf-8")) if FILE.exists() else {}
    kept = data.setdefault(_version(quick), {})
    for item, section in sections.items():
        kept[item] = {
            "rows": {
                row.quantity: [_short(row.ours), _short(row.ratio), row.verdict, row.says]
                for row in section.rows
            },
            "checks": {check.text: [_short(check.value), check.holds] for check in section.checks},
        }
        if not (section.rows or section.checks):
            del kept[item]
    write_files({FILE: json.dumps(data, indent=1, ensure_ascii=False, sort_keys=True) + "\n"})


def _short(value: float | None) -> float | None:
    return None if value is None or not math.isfinite(value) else float(f"{value:.{_DIGITS}g}")


# -------------------------------------------------------------------------------- judging


def judged(section: Section, memory: StoredItem | None) -> tuple[PaperCheck, ...]:
    """Returns a check for every row and every check of a section: whether its numbers are equal to the stored
    ones.

    A row must have the stored verdict, and the stored ratio (or, if the paper prints no number, the stored
    value) within its band. A row that does not agree with the paper must have a topic that explains it. No
    stored number may be missing now, and no number may be new. Without stored numbers only the topics are
    checked.
    """
    lines = [_explained(row) for row in section.rows if row.verdict in ("differs", "opposite")]
    if memory is None:
        return tuple(lines)
    lines += [_row(row, memory) for row in section.rows]
    lines += [_check(check, memory) for check in section.checks if check.band is not None]
    names = {row.quantity for row in section.rows} | {check.text for check in section.checks}
    gone = [name for name in (*memory.rows, *memory.checks) if name not in names]
    return (
        *lines,
        *(PaperCheck(f"“{name}” was stored and is still measured", math.nan, False) for name in gone),
    )


def _explained(row: Row) -> PaperCheck:
    return PaperCheck(
        f"{row.quantity}: {row.verdict}, and a topic explains it", row.ours, row.topic in topics()
    )


def _row(row: Row, memory: StoredItem) -> PaperCheck:
    if row.quantity not in memory.rows:
        return PaperCheck(f"“{row.quantity}” has a stored number", row.ours, False)
    ours, ratio, verdict, says = memory.rows[row.quantity]
    before, now = (ours, row.ours) if ratio is None or row.ratio is None else (ratio, row.ratio)
    same = (row.verdict, row.says, row.ratio is None) == (verdict, says, ratio is None)
    text = f"{row.quantity}: {verdict or 'nothing printed'}, ours {ours:.4g} ± {row.band:.0%}"
    return PaperCheck(text, row.ours, same and _near(now, before, row.band))


def _check(check: PaperCheck, memory: StoredItem) -> PaperCheck:
    if check.text not in memory.checks:
        return PaperCheck(f"“{check.text}” has a stored number", check.value, False)
    before, _ = memory.checks[check.text]
    text = f"{check.text}: {before:.4g} ± {check.band or 0:.0%}"
    return PaperCheck(text, check.value, _near(check.value, before, check.band or 0))


def _near(now: float, before: float, band: float) -> bool:
    if math.isnan(before) or math.isnan(now):
        return math.isnan(before) and math.isnan(now)
    low, high = sorted((before / (1.0 + band), before * (1.0 + band)))
    return low - 1e-12 <= now <= high + 1e-12


# -------------------------------------------------------------------------------- without running


def from_memory(item: Item, memory: StoredItem, quick: bool = False) -> Section:
    """Returns an item's section as if its runs had given the stored numbers; without pictures and further
    tables."""
    nothing = {job: JobResult(job, {}, {}, "not run") for job in item.jobs(quick)}
    section = item.report(nothing, quick)
    rows = tuple(
        replace(row, ours=memory.rows[row.quantity][0]) if row.quantity in memory.rows else row
        for row in section.rows
    )
    checks = []
    for check in section.checks:
        value, holds = memory.checks.get(check.text, (math.nan, False))
        checks.append(replace(check, value=value, holds=holds))
    return Section(section.notes, rows, checks=tuple(checks))
