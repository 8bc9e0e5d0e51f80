"""Controls for settings, made from their descriptions: a slider, switch or menu for each setting."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any, Generic, TypeVar

import viser

from app.adapter.names import NUMBER_BOX, ROW, SLIDER_LABEL
from app.adapter.private import dom_id
from app.html.palette import AXES, css, ink
from app.html.text import block, esc, figure
from app.panels.widgets.command import on_change
from app.tab.context import PageContext
from app.tab.mirror import Bindings, scalar
from lessons.events import Set
from lessons.settings.schema import Setting
from lessons.settings.settings import SceneSettings
from lessons.settings.values import SWITCH, WHOLE, WORD
from lessons.teaching.lesson import Control, chosen
from robots.ranges import Shown

NONE: Mapping[str, str] = MappingProxyType({})
NO_ENDS: Mapping[str, Callable[[Any], float]] = MappingProxyType({})
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


def in_colours_of_axes(buttons: viser.GuiButtonGroupHandle) -> str:
    """Returns a style that gives the buttons of a group, such as "+x", the colours of the arrows in the
    scene."""
    group = f'{ROW}:has(> * > * > label[for="{dom_id(buttons)}"])'
    rules = (
        f"{group} button:nth-of-type({k}){{color:{ink(axis)};border-color:{css(axis)}}}"
        for k, option in enumerate(buttons.options, start=1)
        for axis in [AXES["xyz".index(str(option)[-1])]]
    )
    return f"<style>{''.join(rules)}</style>"


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
        for path in paths:
            self.add_as(self._settings.setting(path))

    def add_group(
        self,
        name: str,
        lists: Mapping[str, str] = NONE,
        elements: Sequence[str] = (),
        ends: Mapping[str, Callable[[S], float]] = NO_ENDS,
    ) -> None:
        """Adds a control for each setting whose description names this group.

        Args:
            name: the group.
            lists: titles, by path, of folders with the elements of lists.
            elements: the labels of the elements.
            ends: functions, by path, that return the end of a slider, in its page unit, for the settings; it
                is at most the usual one.
        """
        for setting in self._settings.table().values():
            if setting.shown.group == name:
                self.add_as(setting, end=ends.get(setting.path))
                if setting.path in lists:
                    self.add_elements(setting.path, elements, lists[setting.path])

    def add_as(
        self,
        setting: Setting,
        read: Callable[[S], Any] | None = None,
        make: Callable[[float], Any] | None = None,
        end: Callable[[S], float] | None = None,
    ) -> None:
        """Adds a control of a setting. Its description may differ from the setting's own.

        Args:
            setting: its path must be the path of a setting.
            read: returns the value to show; None: the setting's value is shown.
            make: converts a slider's number to the setting's value; None: the number is the value.
            end: see `add_group`; None: the slider has its usual end.
        """
        read = setting.read if read is None else read
        with self._gui.add_folder(None):
            if setting.form.kind == SWITCH:
                self._switch(setting, read)
            elif setting.form.kind == WORD:
                self._menu(setting, read)
            else:
                self._slider(setting, read, make, end)

    def add_elements(self, path: str, names: Sequence[str], title: str) -> None:
        """Adds a folder with a number input for each element of a list; `names` are their labels. The inputs
        have the range of the list."""
        shown = self._settings.setting(path).shown
        with self._gui.add_folder(title, expand_by_default=False):
            for at, name in enumerate(names, start=1):
                self._number(
                    replace(self._settings.setting(f"{path}.{at}"), shown=replace(shown, label=name))
                )

    # ---------------------------------------------------------------- kinds of controls

    def _switch(self, setting: Setting, read: Callable[[S], Any]) -> None:
        shown = setting.shown
        box = self._gui.add_checkbox(shown.title, bool(read(self._settings)), hint=shown.help or None)
        self._bindings.bind(box, lambda s: bool(read(s)), lambda on: Set(setting.path, bool(on)))

    def _menu(self, setting: Setting, read: Callable[[S], Any]) -> None:
        shown, now = setting.shown, str(read(self._settings))
        menu = self._gui.add_dropdown(
            shown.title, setting.form.words, initial_value=now, hint=shown.help or None
        )
        self._bindings.bind(menu, lambda s: str(read(s)), lambda word: Set(setting.path, str(word)))

    def _slider(
        self,
        setting: Setting,
        read: Callable[[S], Any],
        make: Callable[[float], Any] | None,
        end: Callable[[S], float] | None,
    ) -> None:
        usual = setting.shown
        if usual.log:
            self._logarithmic(setting, read)
            return
        whole = setting.form.kind == WHOLE
        kind, step = (int, 1) if whole else (float, usual.step or _step(usual.low, usual.high))

        def shown(settings: S) -> Any:
            return kind(round(scalar(read(settings)) * usual.factor, 9))

        now = shown(self._settings)

        def highest(settings: S) -> Any:
            return max(kind(usual.high if end is None else min(usual.high, end(settings))), now)

        slider = self._gui.add_slider(
            usual.title,
            min=min(kind(usual.low), now),
            max=highest(self._settings),
            step=step,
            initial_value=now,
            hint=usual.help or None,
        )

        def event(value: float) -> Set:
            number = kind(value) if usual.factor == 1.0 else float(f"{value / usual.factor:.12g}")
            return Set(setting.path, number if make is None else make(number))

        def follow(settings: S) -> Any:
            if slider.max != highest(settings):
                slider.max = highest(settings)
            return min(max(shown(settings), slider.min), slider.max)

        self._bindings.bind(slider, follow, event)

    def _logarithmic(self, setting: Setting, read: Callable[[S], Any]) -> None:
        shown = setting.shown
        low, high = shown.low, shown.high

        def label(value: float) -> str:
            return f"{shown.label}: {figure(value)}{' ' * bool(shown.unit)}{shown.unit}"

        now = scalar(read(self._settings))
        slider = self._gui.add_slider(
            label(now),
            min=0,
            max=STEPS,
            step=1,
            initial_value=place_of(now, low, high),
            marks=((0, figure(low)), (STEPS, figure(high))),
            hint=shown.help or "Logarithmic",
        )
        self._gui.add_html(only_track(slider))

        def follow(settings: S) -> int:
            value = scalar(read(settings))
            slider.label = label(value)
            return place_of(value, low, high)

        self._bindings.bind(slider, follow, lambda place: Set(setting.path, value_at(place, low, high)))

    def _number(self, setting: Setting) -> None:
        shown, read = setting.shown, setting.read
        value = float(read(self._settings))
        ranged = shown.low < shown.high
        with self._gui.add_folder(None):
            number = self._gui.add_number(
                shown.label,
                value,
                min=min(shown.low if ranged else 1e-6, value),
                max=max(shown.high, value) if ranged else None,
                step=shown.step or _tenth(value),
            )
        self._bindings.bind(number, lambda s: float(read(s)), lambda given: Set(setting.path, float(given)))


class ControllerChoice:
    """The folder with the menu of controllers and a sentence about the chosen one."""

    def __init__(self, gui: viser.GuiApi, controls: Controls[Any], settings: SceneSettings) -> None:
        with gui.add_folder("Which controller"):
            controls.add("controller")
            self._about = gui.add_html("")
        self.update(settings)

    def update(self, settings: SceneSettings) -> None:
        self._about.content = block(esc(settings.controllers[settings.controller]), lines=2)


def add_dark_switch(page: PageContext) -> None:
    """Adds the checkbox of the page's theme."""
    comfort = page.visitor.comfort
    dark = page.gui.add_checkbox("Dark theme", comfort.dark)
    on_change(dark, lambda: comfort.set_theme(bool(dark.value)))


def add_control(
    gui: viser.GuiApi, bindings: Bindings[SceneSettings], control: Control, settings: SceneSettings
) -> None:
    """Adds a control of a lesson, with the lesson's label and range, even if the setting is outside this
    range."""
    if control.choices and control.choices != (False, True):
        _add_choices(gui, bindings, control, settings)
        return
    shown = Shown(control.words, low=control.low, high=control.high, log=control.log)
    setting = replace(settings.setting(control.path), shown=shown)
    read = setting.read

    def inside(settings: SceneSettings) -> float:
        return min(max(scalar(read(settings)), control.low), control.high)

    Controls(gui, bindings, settings).add_as(setting, read if control.choices or control.log else inside)


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
