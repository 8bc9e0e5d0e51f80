"""Controls for settings, generated from the table of settings: a slider, switch or menu for each setting."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, Generic, TypeVar

import viser

from app.adapter.names import NUMBER_BOX, SLIDER_LABEL
from app.adapter.private import dom_id
from app.html.text import figure
from app.panels.widgets.mirror import Bindings, scalar
from lessons.events import Set
from lessons.settings.entry import Entry
from lessons.settings.settings import SceneSettings
from lessons.settings.values import SWITCH, WHOLE, WORD
from lessons.teaching.control import Control, chosen

STEPS = 200
"""Number of steps of a logarithmic slider."""
S = TypeVar("S", bound=SceneSettings)


def place_of(value: float, low: float, high: float) -> int:
    """Returns the position 0 … STEPS of a value on a logarithmic slider."""
    share = math.log(max(value, 1e-300) / low) / math.log(high / low)
    return round(STEPS * min(max(share, 0.0), 1.0))


def value_at(place: float, low: float, high: float) -> float:
    """Returns the value at a position of a logarithmic slider, with three digits."""
    return float(f"{low * (high / low) ** (place / STEPS):.3g}")


def only_track(slider: viser.GuiSliderHandle[Any]) -> str:
    """Returns a style that hides the number box of a slider whose number is only a position."""
    here = f'[id="{dom_id(slider)}"]'
    return f"<style>{here} + {NUMBER_BOX},{here} {SLIDER_LABEL}{{display:none}}</style>"


class Controls(Generic[S]):
    """Adds controls and binds each to the path of a setting: a control shows the setting and posts its
    changes.

    Each control is in an unnamed folder, because viser loses a change if two inputs of the same container
    change at once.
    """

    def __init__(self, gui: viser.GuiApi, bindings: Bindings[S], settings: S) -> None:
        """settings: the settings at the time when the page is built."""
        self._gui, self._bindings, self._settings = gui, bindings, settings

    def add(self, *paths: str) -> None:
        """Adds a control for each path."""
        for path in paths:
            self.add_as(self._settings.entry(path))

    def add_as(
        self,
        entry: Entry,
        read: Callable[[S], Any] | None = None,
        make: Callable[[float], Any] | None = None,
    ) -> None:
        """Adds a control that an entry describes. The entry may differ from the setting's entry in the table.

        Args:
            entry: its path must be the path of a setting.
            read: returns the value to show; None: the setting's value is shown.
            make: converts a slider's number to the setting's value; None: the number is the value.
        """
        place = self._settings.place(entry.path)
        read = place.read if read is None else read
        with self._gui.add_folder(None):
            if place.form.kind == SWITCH:
                self._switch(entry, read)
            elif place.form.kind == WORD:
                self._menu(entry, place.form.words, read)
            else:
                self._slider(entry, read, whole=place.form.kind == WHOLE, make=make)

    def add_elements(self, path: str, names: Sequence[str], title: str) -> None:
        """Adds a folder with a number input for each element of a list; `names` are their labels."""
        entry = self._settings.entry(path)
        with self._gui.add_folder(title, expand_by_default=False):
            for at, name in enumerate(names, start=1):
                self._number(replace(entry, path=f"{path}.{at}", label=name))

    # ---------------------------------------------------------------- kinds of controls

    def _switch(self, entry: Entry, read: Callable[[S], Any]) -> None:
        box = self._gui.add_checkbox(entry.title, bool(read(self._settings)), hint=entry.help or None)
        self._bindings.bind(box, lambda s: bool(read(s)), lambda on: Set(entry.path, bool(on)))

    def _menu(self, entry: Entry, words: tuple[str, ...], read: Callable[[S], Any]) -> None:
        now = str(read(self._settings))
        menu = self._gui.add_dropdown(entry.title, words, initial_value=now, hint=entry.help or None)
        self._bindings.bind(menu, lambda s: str(read(s)), lambda word: Set(entry.path, str(word)))

    def _slider(
        self, entry: Entry, read: Callable[[S], Any], whole: bool, make: Callable[[float], Any] | None
    ) -> None:
        if entry.log:
            self._logarithmic(entry, read)
            return
        kind, step = (int, 1) if whole else (float, entry.step or _step(entry.low, entry.high))

        def shown(settings: S) -> Any:
            return kind(round(scalar(read(settings)) * entry.factor, 9))

        now = shown(self._settings)
        slider = self._gui.add_slider(
            entry.title,
            min=min(kind(entry.low), now),
            max=max(kind(entry.high), now),
            step=step,
            initial_value=now,
            hint=entry.help or None,
        )

        def event(value: float) -> Set:
            number = kind(value) if entry.factor == 1.0 else float(f"{value / entry.factor:.12g}")
            return Set(entry.path, number if make is None else make(number))

        self._bindings.bind(slider, lambda s: min(max(shown(s), slider.min), slider.max), event)

    def _logarithmic(self, entry: Entry, read: Callable[[S], Any]) -> None:
        low, high = entry.low, entry.high

        def label(value: float) -> str:
            return f"{entry.label}: {figure(value)}{' ' * bool(entry.unit)}{entry.unit}"

        now = scalar(read(self._settings))
        slider = self._gui.add_slider(
            label(now),
            min=0,
            max=STEPS,
            step=1,
            initial_value=place_of(now, low, high),
            marks=((0, figure(low)), (STEPS, figure(high))),
            hint=entry.help or "Logarithmic",
        )
        self._gui.add_html(only_track(slider))

        def follow(settings: S) -> int:
            value = scalar(read(settings))
            if slider.label != label(value):
                slider.label = label(value)
            return place_of(value, low, high)

        self._bindings.bind(slider, follow, lambda place: Set(entry.path, value_at(place, low, high)))

    def _number(self, entry: Entry) -> None:
        read = self._settings.place(entry.path).read
        value = float(read(self._settings))
        ranged = entry.low < entry.high
        with self._gui.add_folder(None):
            number = self._gui.add_number(
                entry.label,
                value,
                min=min(entry.low if ranged else 1e-6, value),
                max=max(entry.high, value) if ranged else None,
                step=entry.step or _tenth(value),
            )
        self._bindings.bind(number, lambda s: float(read(s)), lambda given: Set(entry.path, float(given)))


def add_control(
    gui: viser.GuiApi, bindings: Bindings[SceneSettings], control: Control, settings: SceneSettings
) -> None:
    """Adds a control of a lesson, with the lesson's label and range, even if the setting is outside this
    range."""
    if control.choices and control.choices != (False, True):
        _add_choices(gui, bindings, control, settings)
        return
    entry = Entry(control.path, control.words, low=control.low, high=control.high, log=control.log)
    read = settings.place(control.path).read

    def inside(settings: SceneSettings) -> float:
        return min(max(scalar(read(settings)), control.low), control.high)

    Controls(gui, bindings, settings).add_as(entry, read if control.choices or control.log else inside)


def _add_choices(
    gui: viser.GuiApi, bindings: Bindings[SceneSettings], control: Control, settings: SceneSettings
) -> None:
    of = {_words(choice): choice for choice in control.choices}

    def shown(settings: SceneSettings, otherwise: str) -> str:
        found = chosen(settings, control)
        return otherwise if found is None else _words(found)

    menu = gui.add_dropdown(control.words, tuple(of), initial_value=shown(settings, next(iter(of))))
    bindings.bind(
        menu,
        # A menu cannot show a value that is not among its options.
        lambda s: shown(s, str(menu.value)),
        lambda value: Set(control.path, of[str(value)]),
    )


def _words(value: Any) -> str:
    """Returns the label of an option in a menu."""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_words, value))
    return figure(value) if isinstance(value, float) else str(value)


def _step(low: float, high: float) -> float:
    """Returns the step of a slider: 1 or 5 times a power of ten, at most a two-hundredth of the range."""
    rough = (high - low) / 200
    power = 10.0 ** math.floor(math.log10(rough))
    return float(f"{(5 if rough >= 5 * power else 1) * power:.3g}")


def _tenth(value: float) -> float:
    """Returns the step of a number input: a tenth of the value's decade, at most 0.1. One click visibly
    changes any value. For 0, which has no decade, the step is a thousandth of the unit."""
    return min(0.1, 10.0 ** (math.floor(math.log10(value)) - 1)) if value > 0.0 else 1e-3
