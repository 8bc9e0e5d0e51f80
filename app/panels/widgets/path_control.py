"""A lesson's few controls: sliders, logarithmic ones, switches and menus for any setting by its path."""

from __future__ import annotations

import math
from typing import Any

import viser

from app.adapter.private import dom_id
from app.html.text import figure
from app.panels.widgets.mirror import Bindings, scalar
from lessons.events import Set
from lessons.settings.settings import Settings
from lessons.teaching.control import Control, chosen

STEPS = 200
"""Places of a logarithmic slider."""


def place_of(value: float, low: float, high: float) -> int:
    """Where a value stands on a logarithmic slider, 0 … STEPS."""
    share = math.log(max(value, 1e-300) / low) / math.log(high / low)
    return round(STEPS * min(max(share, 0.0), 1.0))


def value_at(place: float, low: float, high: float) -> float:
    """The value at a place of a logarithmic slider, with three digits."""
    return float(f"{low * (high / low) ** (place / STEPS):.3g}")


def only_track(slider: viser.GuiSliderHandle[Any]) -> str:
    """A style that hides the numbers of a slider where they would be a mere place."""
    here = f'[id="{dom_id(slider)}"]'
    return f"<style>{here} + .mantine-NumberInput-root,{here} .mantine-Slider-label{{display:none}}</style>"


def add_control(
    gui: viser.GuiApi, bindings: Bindings[Settings], control: Control, settings: Settings
) -> None:
    """The control, showing what the settings have and posting what the learner sets."""
    now = settings.value_at(control.path)
    if control.choices == (False, True):
        switch = gui.add_checkbox(control.words, bool(now))
        bindings.bind(
            switch,
            lambda s: bool(s.value_at(control.path)),
            lambda value: Set(control.path, bool(value)),
        )
    elif control.choices:
        of = {_words(choice): choice for choice in control.choices}
        menu = gui.add_dropdown(
            control.words, tuple(of), initial_value=_shown(settings, control, next(iter(of)))
        )
        bindings.bind(
            menu,
            # What the menu does not offer cannot be shown in it.
            lambda s: _shown(s, control, str(menu.value)),
            lambda value: Set(control.path, of[str(value)]),
        )
    elif control.log:
        _logarithmic(gui, bindings, control, scalar(now))
    else:
        whole = isinstance(now, int)
        step = 1 if whole else _step(control.low, control.high)
        slider = gui.add_slider(
            control.words,
            min=int(control.low) if whole else control.low,
            max=int(control.high) if whole else control.high,
            step=step,
            initial_value=_inside(now if whole else scalar(now), control),
        )
        bindings.bind(
            slider,
            lambda s: _inside(scalar(s.value_at(control.path)), control),
            lambda value: Set(control.path, int(value) if whole else float(value)),
        )


def _words(value: Any) -> str:
    """A choice in a menu."""
    if isinstance(value, (list, tuple)):
        return ", ".join(map(_words, value))
    return figure(value) if isinstance(value, float) else str(value)


def _shown(settings: Settings, control: Control, otherwise: str) -> str:
    found = chosen(settings, control)
    return otherwise if found is None else _words(found)


def _inside(value: float, control: Control) -> Any:
    return min(max(value, type(value)(control.low)), type(value)(control.high))


def _step(low: float, high: float) -> float:
    """About a hundredth of the range, a power of ten times 1 or 5."""
    rough = (high - low) / 200
    power = 10.0 ** math.floor(math.log10(rough))
    return float(f"{(5 if rough >= 5 * power else 1) * power:.3g}")


def _logarithmic(gui: viser.GuiApi, bindings: Bindings[Settings], control: Control, now: float) -> None:
    low, high = control.low, control.high

    def label(value: float) -> str:
        return f"{control.words}: {figure(value)}"

    slider = gui.add_slider(
        label(now),
        min=0,
        max=STEPS,
        step=1,
        initial_value=place_of(now, low, high),
        marks=((0, figure(low)), (STEPS, figure(high))),
        hint="Logarithmic",
    )
    gui.add_html(only_track(slider))

    def read(settings: Settings) -> int:
        value = scalar(settings.value_at(control.path))
        if slider.label != label(value):
            slider.label = label(value)
        return place_of(value, low, high)

    bindings.bind(slider, read, lambda place: Set(control.path, value_at(place, low, high)))
