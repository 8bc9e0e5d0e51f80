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
from himpc.stack import Level

ON, OFF, UP, DOWN, MORE = "on", "off", "▲", "▼", "⋯"
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
    """The row of one level. `details` is the folder of its settings. Over the scene the row is drawn once
    more, without settings."""

    def __init__(
        self,
        page: PageContext,
        level: Level,
        place: int,
        others: tuple[str, ...],
        hints: tuple[str, str],
        press: Callable[[str], None],
        strip: viser.GuiTabHandle | viser.GuiFolderHandle | None,
        opened: bool = False,
    ) -> None:
        """place: the index of the level, 0 being the highest priority; others: the buttons beside that for on
        and off; hints: of the buttons, over the scene and in the tab; press: called with the button that was
        pressed; strip: the place over the scene; opened: whether the settings are open."""
        self._gui, self.name, self._others = page.gui, level.name, others
        self._colour = page.colours.get(level.name, BOUND)
        first = (ON if level.enabled else OFF, *others)
        self._drawn = [self._draw(f"Level {self.name}", (*first, MORE), hints[1], press)]
        with self._drawn[0].folder:
            self.details = page.gui.add_folder(f"Settings of {self.name}", visible=opened)
        if strip is not None:
            with strip:
                self._drawn.append(self._draw(self.name, first, hints[0], press))
        self.update(place, level.enabled)

    def _draw(self, label: str, names: tuple[str, ...], hint: str, press: Callable[[str], None]) -> _Drawn:
        with self._gui.add_folder(None) as folder:
            text = self._gui.add_html("")
            buttons = self._gui.add_button_group(label, names, hint=hint)
            row = f'{ROW}:has(> * > * > label[for="{dom_id(buttons)}"])'
            self._gui.add_html(_STYLE.format(row, _EACH * len(names), ROW))

        def pressed() -> None:
            if buttons.value == MORE:
                self.details.visible = not self.details.visible
            press(str(buttons.value))

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
            names = (ON if on else OFF, *self._others, *buttons.options[1 + len(self._others) :])
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
