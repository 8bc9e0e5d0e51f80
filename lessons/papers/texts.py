"""The texts of the items, which `items.toml` contains: title, source, notes, and caption of the picture."""

from __future__ import annotations

import tomllib
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import cache, partial
from pathlib import Path
from typing import Any

from lessons.experiments.jobs import Results, Work
from lessons.papers.item import Item, Section
from lessons.plots.panels import Bars, Panel, Picture

Jobs = Callable[[bool], tuple[Work, ...]]
Report = Callable[[Results, bool], Section]


@cache
def _texts() -> dict[str, dict[str, Any]]:
    return tomllib.loads(Path(__file__).with_name("items.toml").read_text(encoding="utf-8"))


def described(name: str, jobs: Jobs | tuple[Work, ...], report: Report) -> Item:
    """Returns an item with its texts. jobs: see `Item.jobs`, or the runs of both versions; report: returns
    the section without the notes of the file, which come first."""
    texts = _texts()[name]
    runs = jobs if callable(jobs) else partial(_always, jobs)
    return Item(name, texts["title"], texts["source"], runs, partial(_noted, texts.get("notes", ()), report))


def _always(runs: tuple[Work, ...], quick: bool) -> tuple[Work, ...]:
    return runs


def _noted(notes: Sequence[str], report: Report, results: Results, quick: bool) -> Section:
    section = report(results, quick)
    return replace(section, notes=(*notes, *section.notes))


def drawn(
    name: str,
    panels: Sequence[Panel | Bars],
    columns: int = 1,
    words: dict[str, Any] | None = None,
    **parts: Any,
) -> Section:
    """Returns a section with one picture.

    Args:
        name: that of the picture, with which the file has its caption.
        panels, columns: see `Picture`.
        words: the words in braces of the caption.
        parts: the other fields of the section.
    """
    caption = _texts()[name]["caption"].format_map(words or {})
    return Section(pictures=(Picture(name, caption, tuple(panels), columns),), **parts)
