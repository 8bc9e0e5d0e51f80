"""The levels of a velocity-level controller: a row for the point that each level moves."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.client.pending_edit import PendingEdit
from app.html.text import block, quantity
from app.panels.widgets.controls import Controls
from app.panels.widgets.level_row import MORE, OFF, ON, LevelRow
from app.tab.context import PageContext, SessionSnapshot
from himpc.stack import Level
from lessons.events import Set
from lessons.settings.velocity import VelocitySettings


class RolesPanel:
    """One row per role, in the order of the mission's window."""

    def __init__(
        self,
        page: PageContext,
        strip: viser.GuiTabHandle | None,
    ) -> None:
        """strip: the tab of a panel over the scene, which shows the rows, too."""
        self._page, levels = page, page.settings.levels
        self._order = tuple(level.name for level in levels)
        self._enabled: dict[str, PendingEdit[bool]] = {name: PendingEdit() for name in self._order}
        page.gui.add_html(block("The mission below sets the order of the levels."), order=-1.0)
        self._cards = [_Card(page, level, place, self._switch, strip) for place, level in enumerate(levels)]

    def toggle(self, place: int) -> Set | None:
        """Returns the event for the hotkey of an index (0-based); None if there is no such level."""
        if place >= len(self._order):
            return None
        return self._switch(self._order[place])

    def _switch(self, name: str) -> Set:
        enabled = next(level.enabled for level in self._page.settings.levels if level.name == name)
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
    """The row of one role."""

    def __init__(
        self,
        page: PageContext,
        level: Level,
        place: int,
        switch: Callable[[str], Set],
        strip: viser.GuiTabHandle | None,
    ) -> None:
        name = self.name = level.name
        gui, colour = page.gui, page.colours[name]

        def press(button: str) -> None:
            if button != MORE:
                page.post(switch(name))

        button = (ON if level.enabled else OFF,)
        row = LevelRow(gui, name, colour, button, "⋯: the weight of this level", press)
        self._rows = [row]
        if strip is not None:
            with strip:
                self._rows.append(LevelRow(gui, name, colour, button, "On or off", press, None))
        for shown in self._rows:
            shown.update(place + 1, self._title(place), level.enabled)
        with row.details:
            Controls(gui, page.bindings, page.settings).add(f"levels.{name}.Q")

    def _title(self, place: int) -> str:
        return f"{place + 1} · {self.name}"

    def update(self, now: SessionSnapshot[VelocitySettings], level: Level, place: int, inside: bool) -> None:
        task = level.tasks[0]
        error, bound = now.error(task.name), now.number(f"bound/{level.name}")
        for row in self._rows:
            row.update(
                place + 1,
                self._title(place),
                level.enabled,
                error if inside else 0.0,
                f"<b>{quantity(error, task.unit)}</b>" if inside else "no task now",
                f"≤ {quantity(bound, task.unit)}" if inside and bound == bound else "",
                "Levels below may increase the error of this level to this bound",
                now.fallback(level.name) if inside else "",
            )
