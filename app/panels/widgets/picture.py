"""A picture that lives: what stays is sent once, what moves is painted into it."""

from __future__ import annotations

import json

import viser

from app.adapter import private
from app.html.text import esc
from app.panels.widgets.in_view import InView

_AGAIN = 20
"""Looks after which a picture that did not change is painted once more: a tab that was closed forgot it."""

# The panel may be folded or in a tab behind: then there is nothing to paint into.
_PAINT = """
window.__himpcLabPaint = (title, markup) => {
  for (const each of document.querySelectorAll("[data-chart]"))
    if (each.dataset.chart === title) each.querySelector(".live").innerHTML = markup;
};
"""


class Picture:
    """An SVG that is as wide as its panel."""

    def __init__(
        self, client: viser.ClientHandle, in_view: InView, title: str, size: tuple[int, int], empty: str
    ) -> None:
        """title: of the picture, unlike all others; size: width and height, units of its own; empty: words
        that stand there until the first painting."""
        self._client, self._in_view, self.title = client, in_view, title
        width, height = size
        private.run_script(client, _PAINT)
        words = f'<text x="{width / 2:g}" y="{height / 2:g}" text-anchor="middle">{esc(empty)}</text>'
        self._handle = client.gui.add_html(
            f'<div data-chart="{esc(title)}" style="padding:0.2em 0.5em">'
            f'<svg viewBox="0 0 {width} {height}" width="100%" role="img" aria-label="{esc(title)}" '
            'style="display:block;max-width:42em;margin:auto" font-size="11" font-family="inherit" '
            f'fill="currentColor"><g class="live">{words}</g></svg></div>'
        )
        self._painted = ""
        self._looks = 0

    @property
    def in_view(self) -> bool:
        """Whether the browser has told that it shows it."""
        return self._in_view.told and self._in_view.sees(self.title)

    def paint(self, markup: str) -> None:
        """SVG elements, instead of those that were there; nothing is sent where nothing changed."""
        self._looks += 1
        if not self.in_view or (markup == self._painted and self._looks % _AGAIN):
            return
        self._painted = markup
        call = f"window.__himpcLabPaint?.({json.dumps(self.title)}, {json.dumps(markup)})"
        private.run_script(self._client, call)

    def show(self, on: bool) -> None:
        """Whether it takes any room."""
        if self._handle.visible != on:
            self._handle.visible = on
