"""The levels of a velocity-level controller: the point that each level moves, and the level's switch, Q,
error and bound."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.client.pending_edit import PendingEdit
from app.html.palette import BAD, DAMPING, RGB, css
from app.html.text import badge, block, quantity, swatch
from app.panels.widgets.controls import Controls
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.snapshot import SessionSnapshot
from himpc.stack import Level
from lessons.events import Set
from lessons.session.velocity_rows import FALLBACKS
from lessons.settings.velocity import VelocitySettings


class RolesPanel:
    """One folder per role, in the order of the mission's window."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[VelocitySettings],
        settings: VelocitySettings,
        colours: dict[str, RGB],
        current: Callable[[], VelocitySettings],
    ) -> None:
        self._current = current
        self._order = tuple(level.name for level in settings.levels)
        self._enabled: dict[str, PendingEdit[bool]] = {name: PendingEdit() for name in self._order}
        gui.add_html(
            block("The levels have the order of the tasks in the mission's window, which you can change in "
                  "the tab <b>Mission</b>. The number of a level is the key that switches it on or off.")
        )  # fmt: skip
        self._cards = [
            _Card(gui, bindings, settings, level, colours[level.name], place)
            for place, level in enumerate(settings.levels)
        ]

    def toggle(self, place: int) -> Set | None:
        """Returns the event for the hotkey of an index (0-based); None if there is no such level."""
        if place >= len(self._order):
            return None
        name = self._order[place]
        enabled = next(level.enabled for level in self._current().levels if level.name == name)
        wish = self._enabled[name]
        return Set(f"levels.{name}.enabled", wish.ask(not wish.now(enabled)))

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        places = {level.name: now.number(f"level/{level.name}") for level in now.settings.levels}
        inside = sorted((name for name in places if places[name] == places[name]), key=places.__getitem__)
        self._order = (*inside, *(name for name in places if name not in inside))
        for card in self._cards:
            level = next(level for level in now.settings.levels if level.name == card.name)
            card.update(now, level, self._order.index(card.name), card.name in inside)


class _Card:
    """The controls of one role."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[VelocitySettings],
        settings: VelocitySettings,
        level: Level,
        colour: RGB,
        place: int,
    ) -> None:
        name = self.name = level.name
        self._colour = colour
        self._folder = gui.add_folder(_title(place, name), order=float(place + 1))
        with self._folder:
            self._live = gui.add_html(block("", lines=2))
            on = gui.add_checkbox("Enabled", level.enabled, hint=f"Key {place + 1}")
            Controls(gui, bindings, settings).add(f"levels.{name}.Q")
        bindings.bind(
            on, lambda s: _find(s, name).enabled, lambda value: Set(f"levels.{name}.enabled", bool(value))
        )

    def update(self, now: SessionSnapshot[VelocitySettings], level: Level, place: int, inside: bool) -> None:
        title = _title(place, level.name)
        if self._folder.label != title:
            self._folder.label = title
            self._folder.order = float(place + 1)
        task = level.tasks[0]
        text = f"error <b>{quantity(now.error(task.name), task.unit)}</b>"
        bound = now.number(f"bound/{level.name}")
        if bound == bound:
            text += f", levels below may increase it to {quantity(bound, task.unit)}"
        notes = "" if level.enabled else " " + badge("OFF", DAMPING)
        if not inside:
            text, notes = "has no task in the window", ""
        fallback = now.number(f"rung/{level.name}")
        if fallback == fallback and fallback > 0:
            notes += " " + badge(FALLBACKS[int(fallback)], BAD)
        self._live.content = block(
            f"{swatch(self._colour)}{text}{notes}", f"border-left:3px solid {css(self._colour)}", lines=2
        )


def _title(place: int, name: str) -> str:
    return f"{place + 1} · {name}"


def _find(settings: VelocitySettings, name: str) -> Level:
    return next(level for level in settings.levels if level.name == name)
