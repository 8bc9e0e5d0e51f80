"""The levels of a velocity-level controller: a row for the point that each level moves."""

from __future__ import annotations

from functools import partial

import viser

from app.client.pending_edit import PendingEdit
from app.html.text import block, quantity
from app.panels.widgets.controls import Controls
from app.panels.widgets.level_row import MORE, LevelRow
from app.tab.context import PageContext, SessionSnapshot
from lessons.events import Set
from lessons.settings.velocity import VelocitySettings


class RolesPanel:
    """One row per role, in the order of the mission's window."""

    def __init__(self, page: PageContext, strip: viser.GuiTabHandle | None) -> None:
        """strip: the tab of a panel over the scene, which shows the rows, too."""
        self._page, levels = page, page.settings.levels
        self._order = tuple(level.name for level in levels)
        self._enabled: dict[str, PendingEdit[bool]] = {name: PendingEdit() for name in self._order}
        page.gui.add_html(block("The mission below sets the order of the levels."), order=-1.0)
        hints = "On or off", "⋯: the weight of this level"
        self._rows = [
            LevelRow(page, level, place, (), hints, partial(self._press, level.name), strip)
            for place, level in enumerate(levels)
        ]
        for row in self._rows:
            with row.details:
                Controls(page.gui, page.bindings, page.settings).add(f"levels.{row.name}.Q")

    def toggle(self, place: int) -> Set | None:
        """Returns the event for the hotkey of an index (0-based); None if there is no such level."""
        if place >= len(self._order):
            return None
        return self._switch(self._order[place])

    def _press(self, name: str, button: str) -> None:
        if button != MORE:
            self._page.post(self._switch(name))

    def _switch(self, name: str) -> Set:
        enabled = next(level.enabled for level in self._page.settings.levels if level.name == name)
        wish = self._enabled[name]
        return Set(f"levels.{name}.enabled", wish.ask(not wish.now(enabled)))

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        places = {level.name: now.number(f"level/{level.name}") for level in now.settings.levels}
        inside = sorted((name for name in places if places[name] == places[name]), key=places.__getitem__)
        self._order = (*inside, *(name for name in places if name not in inside))
        levels = {level.name: level for level in now.settings.levels}
        for row in self._rows:
            level, name = levels[row.name], row.name
            task, error = level.tasks[0], now.error(level.tasks[0].name)
            bound, has_task = now.number(f"bound/{name}"), name in inside
            row.update(
                self._order.index(name),
                level.enabled,
                error if has_task else 0.0,
                f"<b>{quantity(error, task.unit)}</b>" if has_task else "no task now",
                f"≤ {quantity(bound, task.unit)}" if has_task and bound == bound else "",
                "Levels below may increase the error of this level to this bound",
                now.fallback(name) if has_task else "",
            )
