"""Sentences, rows and printed values that several items share."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from lessons.experiments.jobs import JobResult
from lessons.papers.item import Row, Verdict
from lessons.scenes.catalog import load_scene


def printed(table: str) -> dict[str, Any]:
    """Returns the values that a paper prints in a table, e.g. printed("himpc_table_2")."""
    return read(table)


def read(table: str) -> dict[str, Any]:
    """Returns the content of a file of values."""
    return tomllib.loads((Path(__file__).parent / "values" / f"{table}.toml").read_text(encoding="utf-8"))


def number(value: float | None) -> str:
    """Returns a number with three significant digits, "–" if there is none."""
    return "–" if value is None or not math.isfinite(value) else f"{value:.3g}"


def tally(rows: Sequence[Row]) -> str:
    """Says how many rows agree, differ and are opposite; "–" if there are none."""
    verdicts = [row.verdict for row in rows]
    counted = [
        f"{verdicts.count(verdict)} {words}" for verdict, words in _VERDICTS.items() if verdict in verdicts
    ]
    return ", ".join(counted) or "–"


_VERDICTS: dict[Verdict, str] = {"agrees": "agree", "differs": "differ", "opposite": "opposite"}


def trouble(run: JobResult) -> str:
    """Returns a sentence about the cause if a run has no figures; "" if it has figures."""
    if run.error is not None:
        return f"could not be run: {run.error}"
    return "" if run.lost_at is None else f"lost control at {run.lost_at:.2f} s"


def unprinted(
    quantity: str, unit: str, ours: float, why: str = "the paper prints no number", **more: Any
) -> Row:
    """Returns a row with a number that the paper does not print. more: further fields of the row."""
    return Row(quantity, unit, None, ours, why, **more)


def stated(quantity: str, ours: float, key: str, words: str, topic: str = "") -> Row:
    """Returns a row with a ratio that HIMPC's paper states in words: `words`, and the side of 1 that the
    values of the text contain under `key`."""
    says = printed("himpc_text")[key]
    why = f"the paper says: {words.format(says=says)}"
    return unprinted(quantity, "1", ours, why, turns_at=1.0, says=says, topic=topic)


def gain_rows(scene: str, table: dict[str, Any]) -> tuple[Row, ...]:
    """Rows with the stiffness and damping of a scene beside those of a table; NaN if the coordinates of a
    task have different gains."""
    tasks = {task.name: task for level in load_scene(scene).settings.levels for task in level.tasks}
    rows = []
    for entry in table["tasks"]:
        task = tasks[entry["scene_task"]]
        for gain, words, unit in (("K_p", "stiffness", "1/s²"), ("K_v", "damping", "1/s")):
            used = np.unique(np.asarray(getattr(task, gain), float))
            ours = float(used[0]) if used.size == 1 else math.nan
            rows.append(
                Row(
                    f"{entry['label']}, {words}",
                    unit,
                    entry[gain],
                    ours,
                    "the scene has other gains",
                    within=1e-9,
                    band=1e-9,
                    copied=True,
                )
            )
    return tuple(rows)
