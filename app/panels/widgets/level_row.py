"""A level in one row: colour, name, error as a bar, freedom, buttons; its settings on request."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import NamedTuple

import viser

from app.adapter.names import ROW
from app.adapter.private import dom_id
from app.html.palette import BAD, BOUND, css
from app.html.text import badge, bar, esc, quantity
from app.panels.widgets.command import on_click
from app.tab.context import PageContext
from app.tab.mirror import PendingEdit
from himpc.stack import Level
from lessons.events import Set

_ON, _OFF, _UP, _DOWN, _MORE = "on", "off", "▲", "▼", "⋯"
_LEAST = 1e-5
"""The error, m or rad, at which the bar begins; it is full at 1 m or 1 rad. Its scale is logarithmic."""
_EACH = 2.2  # em: width of a button
_STYLE = (
    "<style>{0}{{position:relative;margin:-2.6em 0.6em 0.6em auto;width:{1}em}}"
    "{0}>:last-child{{flex:1}}{0} {2}{{flex-wrap:nowrap!important;gap:0.2em!important}}"
    "{0}>:first-child{{position:absolute!important;width:1px!important;height:1px;padding:0!important;"
    "overflow:hidden;clip-path:inset(50%)}}"
    "{0} button{{padding:0;min-width:0;flex:1;height:2em}}</style>"
)
"""Puts the buttons at the right end of the text above them. Their label is for screen readers."""
_CUT = "min-width:0;overflow:hidden;text-overflow:ellipsis"


class _Drawn(NamedTuple):
    """One drawing of a row. room: width of its buttons, em."""

    folder: viser.GuiFolderHandle
    text: viser.GuiHtmlHandle
    buttons: viser.GuiButtonGroupHandle
    room: float


class LevelRow:
    """The row of one level, with the button that switches it on or off. `details` is the folder of its
    settings. Over the scene the row is drawn once more, without settings."""

    def __init__(
        self,
        page: PageContext,
        level: Level,
        place: int,
        hints: tuple[str, str],
        strip: viser.GuiTabHandle | viser.GuiFolderHandle | None,
        opened: bool = False,
        move: Callable[[str, int], None] | None = None,
    ) -> None:
        """place: the index of the level, 0 being the highest priority; hints: of the buttons, over the scene
        and in the tab; strip: the place over the scene; opened: whether the settings are open; move: called
        with the level's name and −1 or +1 when the level should go up or down; None: it has no buttons for
        this."""
        self._page, self._gui, self.name, self._move = page, page.gui, level.name, move
        self._enabled: PendingEdit[bool] = PendingEdit()
        self._others = () if move is None else (_UP, _DOWN)
        self._colour = page.colours.get(level.name, BOUND)
        first = (_ON if level.enabled else _OFF, *self._others)
        self._drawn = [self._draw(f"Level {self.name}", (*first, _MORE), hints[1])]
        with self._drawn[0].folder:
            self.details = page.gui.add_folder(f"Settings of {self.name}", visible=opened)
        if strip is not None:
            with strip:
                self._drawn.append(self._draw(self.name, first, hints[0]))
        self.update(place, level.enabled)

    def toggle(self) -> None:
        """Switches the level on or off, unless another stack without it has just taken effect."""
        for level in self._page.settings.levels:
            if level.name == self.name:
                on = self._enabled.ask(not self._enabled.now(level.enabled))
                self._page.post(Set(f"levels.{self.name}.enabled", on))

    def _draw(self, label: str, names: tuple[str, ...], hint: str) -> _Drawn:
        with self._gui.add_folder(None) as folder:
            text = self._gui.add_html("")
            buttons = self._gui.add_button_group(label, names, hint=hint)
            row = f'{ROW}:has(> * > * > label[for="{dom_id(buttons)}"])'
            self._gui.add_html(_STYLE.format(row, _EACH * len(names), ROW))

        def pressed() -> None:
            if buttons.value == _MORE:
                self.details.visible = not self.details.visible
            elif self._move is not None and buttons.value in self._others:
                self._move(self.name, -1 if buttons.value == _UP else 1)
            else:
                self.toggle()

        on_click(buttons, pressed)
        return _Drawn(folder, text, buttons, _EACH * len(names) + 1.5)

    def update(
        self,
        place: int,
        on: bool,
        error: float = 0.0,
        error_words: str = "",
        free: str = "",
        about: str = "",
        fault: str = "",
    ) -> None:
        """Updates the row. Before the first control step there is neither an error nor a freedom.

        Args:
            place: as for the constructor.
            on: whether the level is switched on.
            error, error_words: its error, m or rad, and the same in words.
            free: its freedom, in few words.
            about: an explanation of its freedom.
            fault: the fallback that was applied; "" for none.
        """
        title = esc(f"{place + 1} · {self.name}")
        share = math.log10(error / _LEAST) / -math.log10(_LEAST) if error > _LEAST else 0.0
        note = badge(fault, BAD) if fault else f'<span title="{esc(about)}">{esc(free)}</span>'
        line = "display:flex;justify-content:space-between;gap:0.6em;align-items:center;white-space:nowrap"
        for folder, text, buttons, room in self._drawn:
            folder.order = float(place)
            names = (_ON if on else _OFF, *self._others, *buttons.options[1 + len(self._others) :])
            buttons.options = names
            text.content = (
                f'<div style="font-size:0.85em;line-height:1.35;height:2.8em;margin:0.2em 0 0.25em 0.75em;'
                f"padding:0 {room / 0.85:.1f}em 0 0.5em;border-left:5px solid {css(self._colour)};"
                f'overflow:hidden"><div style="{line}"><b style="{_CUT}" title="{title}">{title}</b>'
                f"<span>{error_words}</span></div>"
                f'<div style="{line}"><div style="flex:1">{bar(share if on else 0.0, self._colour)}</div>'
                f"{note}</div></div>"
            )


def error_in_words(errors: Sequence[tuple[str, float, str]]) -> str:
    """Returns errors as HTML, each given as name, value in m or rad, and unit. They have the order of the
    tasks in the level's name; each names its task when the mouse is over it."""
    return ", ".join(f'<b title="{esc(name)}">{quantity(value, unit)}</b>' for name, value, unit in errors)
