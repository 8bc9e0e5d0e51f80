"""A picture that changes: its constant parts are sent once, and changed parts are redrawn."""

from __future__ import annotations

import json
import time
from collections.abc import Sequence

import viser

from app.adapter import private
from app.html.svg import element, picture, text
from app.html.text import esc
from app.tab.in_view import InView

_EVERY = 0.15  # s between two updates: a moving picture needs several kilobytes per second
_AGAIN = 15
"""Number of updates after which the whole picture is sent again, since a tab that was closed has lost
its picture."""

# If the panel is folded or its tab is hidden, the element does not exist, and the script does nothing.
_PAINT = """
window.__himpcLabPaint = (title, count, changes) => {
  for (const each of document.querySelectorAll("[data-chart]")) {
    if (each.dataset.chart !== title) continue;
    const live = each.querySelector(".live");
    if (live.querySelectorAll(":scope > g").length !== count) live.innerHTML = "<g></g>".repeat(count);
    for (const [place, markup] of changes) live.children[place].innerHTML = markup;
  }
};
"""


class SvgPicture:
    """An SVG picture that is as wide as its panel."""

    def __init__(
        self, client: viser.ClientHandle, in_view: InView, title: str, size: tuple[int, int], empty: str
    ) -> None:
        """title: a unique title of the picture; size: width and height in units of the picture; empty: text
        that is shown until the first update."""
        self._client, self._in_view, self.title = client, in_view, title
        width, height = size
        private.run_script(client, _PAINT)
        live = element("g", text(width / 2, height / 2, empty, "middle"), class_="live")
        drawn = picture(
            width, height, title, live, "display:block;max-width:42em;margin:auto;fill:currentColor"
        )
        self._handle = client.gui.add_html(
            f'<div data-chart="{esc(title)}" style="padding:0.2em 0.5em">{drawn}</div>'
        )
        self._painted: list[str] = []
        self._looks = 0
        self._next = 0.0

    @property
    def in_view(self) -> bool:
        """Whether the browser has reported that it shows the picture."""
        seen = self._in_view.told and self._in_view.sees(self.title)
        if not seen:
            self._painted = []  # a browser that shows the picture again gets the whole picture
        return seen

    def paint(self, parts: Sequence[str]) -> None:
        """Replaces the SVG elements of the picture, given as layers from back to front; only changed layers
        are sent."""
        now = time.monotonic()
        if not self.in_view or now < self._next:
            return
        self._next = now + _EVERY
        self._looks += 1
        if self._looks % _AGAIN == 0 or len(parts) != len(self._painted):
            self._painted = [""] * len(parts)
        changes = [[k, part] for k, part in enumerate(parts) if part != self._painted[k]]
        if not changes:
            return
        self._painted = list(parts)
        call = f"window.__himpcLabPaint?.({json.dumps(self.title)}, {len(parts)}, {_script(changes)})"
        private.run_script(self._client, call)


def _script(value: object) -> str:
    """Returns the update as JavaScript."""
    return json.dumps(value, ensure_ascii=False, separators=(",", ":"))
