"""Controls of one setting each, bound to its path."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import viser

from app.panels.widgets.mirror import Bindings
from lessons.events import Set
from lessons.settings.settings import Settings

S = TypeVar("S", bound=Settings)
Span = tuple[float, float, float]
"""Least, greatest, step."""


def add_slider(
    gui: viser.GuiApi,
    bindings: Bindings[S],
    settings: S,
    label: str,
    path: str,
    span: Span,
    read: Callable[[S], float],
    hint: str,
    unit: float = 1.0,
    make: Callable[[S, float], Any] = lambda _, value: value,
    current: Callable[[], S] | None = None,
) -> None:
    """A number. read: its value in SI units; unit: what the slider shows per SI unit; make: the setting's
    value from the number and the settings in force, which `current` gives (needed only with `make`)."""
    low, high, step = span

    def shown(settings: S) -> float:
        return round(read(settings) * unit, 6)

    with gui.add_folder(None):
        slider = gui.add_slider(
            label,
            min=min(low, shown(settings)),
            max=max(high, shown(settings)),
            step=step,
            initial_value=shown(settings),
            hint=hint,
        )

    def event(number: float) -> Set:
        return Set(path, make(settings if current is None else current(), round(float(number) / unit, 9)))

    bindings.bind(slider, shown, event)


def add_whole(
    gui: viser.GuiApi,
    bindings: Bindings[S],
    settings: S,
    label: str,
    path: str,
    span: tuple[int, int],
    read: Callable[[S], int],
    hint: str,
) -> None:
    """A whole number."""
    with gui.add_folder(None):
        slider = gui.add_slider(
            label,
            min=span[0],
            max=max(span[1], read(settings)),
            step=1,
            initial_value=read(settings),
            hint=hint,
        )
    bindings.bind(slider, read, lambda number: Set(path, int(number)))


def add_box(
    gui: viser.GuiApi,
    bindings: Bindings[S],
    settings: S,
    label: str,
    path: str,
    read: Callable[[S], bool],
    hint: str | None = None,
) -> None:
    """On or off."""
    with gui.add_folder(None):
        box = gui.add_checkbox(label, read(settings), hint=hint)
    bindings.bind(box, read, lambda on: Set(path, bool(on)))


def add_menu(
    gui: viser.GuiApi,
    bindings: Bindings[S],
    settings: S,
    label: str,
    path: str,
    choices: Sequence[str],
    read: Callable[[S], str],
    hint: str,
) -> None:
    """One of some names."""
    with gui.add_folder(None):
        menu = gui.add_dropdown(label, tuple(choices), initial_value=read(settings), hint=hint)
    bindings.bind(menu, read, lambda name: Set(path, str(name)))
