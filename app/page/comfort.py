"""Help for people who use a screen reader, need contrast, or are disturbed by motion on the screen: names of
inputs and buttons, the language, and colours as WCAG 2.1 AA requires, and sentences about what happens."""

from __future__ import annotations

import json
import re
import time
from typing import TYPE_CHECKING

import viser

from app.adapter import private
from app.adapter.names import CHART, CLOSES_NOTICE, FOLDED_PANEL, ICON_BUTTON, ROW, SCROLLS, STORED
from app.client.simulation_client import SimulationClient
from app.link.messages import Play
from app.panels.run.narration import Narration, facts_of

if TYPE_CHECKING:
    from app.panels.widgets.snapshot import SessionSnapshot
    from lessons.settings.settings import SceneSettings

# Mantine's default colours of labels and buttons have a contrast of 3.3 and 3.6 on a white page.
STYLE = """
:root[data-mantine-color-scheme="light"] {
  --mantine-color-dimmed: #5a6068;
  --mantine-color-blue-filled: #1a66b8; --mantine-color-blue-filled-hover: #15539a;
  --mantine-color-blue-outline: #1a66b8; --mantine-primary-color-filled: #1a66b8;
}
:root[data-mantine-color-scheme="dark"] {
  --mantine-color-dimmed: #a9adb3;
  --mantine-color-blue-filled: #1a66b8; --mantine-color-blue-filled-hover: #1d70ca;
  --mantine-color-blue-outline: #6db3f5; --mantine-primary-color-filled: #1a66b8;
}
"""

# A slider and the number box beside it share one label, but viser names at most one of the two. Controls
# appear and disappear with tabs; therefore the script checks regularly.
_NAMES = """
const row = %s, icon = %s, closes = %s, scrolls = %s, chart = %s, folded = %s, key = "__himpcLabNames";
window[key]?.();
const empty = (each) => !each.getAttribute("aria-label") && !each.getAttribute("aria-labelledby");
const name = (each, words) => { if (words && empty(each)) each.setAttribute("aria-label", words); };
const look = () => {
  for (const label of document.querySelectorAll("label[for]")) {
    const words = label.textContent.trim(), around = label.closest(row);
    for (const each of around?.querySelectorAll("input, textarea, [role=slider]") ?? [])
      if (each.id !== label.htmlFor || each.getAttribute("role") === "slider") name(each, words);
  }
  for (const each of document.querySelectorAll(closes)) name(each, "Close this notice");
  for (const each of document.querySelectorAll(icon))
    if (!each.textContent.trim()) name(each, "Commands and settings");
  for (const each of document.querySelectorAll(scrolls)) each.tabIndex = 0;
  for (const bar of document.querySelectorAll(`${folded}[role=tablist]`)) {
    bar.setAttribute("role", "group");
    bar.removeAttribute("aria-orientation");
    for (const each of bar.querySelectorAll("[role=tab]")) {
      each.setAttribute("role", "button");
      each.removeAttribute("aria-selected");
    }
  }
  for (const each of document.querySelectorAll("canvas")) {
    if (each.closest(chart)) { each.setAttribute("aria-hidden", "true"); continue; }
    each.setAttribute("role", "img");
    name(each, "The robot in its scene");
  }
};
const timer = setInterval(look, 400);
window[key] = () => clearInterval(timer);
look();
"""
MOTION = "himpc-lab-motion"
REDUCED = "reduced"
LINE = "himpc-lab-says"
"""Identifier, in the browser's document, of the line that says what happens."""

ASK_MOTION = """try {
  const reduced = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
  localStorage.setItem("%s%s", reduced ? "%s" : "");
} catch {}""" % (STORED, MOTION, REDUCED)  # noqa: UP031
"""Stores in the browser whether its user asked for less motion."""
ASK_WINDOW = """try {
  localStorage.setItem("%s%s", `${window.innerWidth}x${window.innerHeight}`);
} catch {}"""
"""Stores the size of the window under a key. When a page connects again, its panels are docked, and its scene
is smaller than the window."""

# A screen reader announces only changes of a region that already exists. Therefore the region stays when a
# scene is replaced.
_BEGIN = """(() => {
  const line = document.getElementById(%(line)s) ?? document.createElement("div");
  line.id = %(line)s;
  line.setAttribute("role", "status");
  line.setAttribute("aria-live", "polite");
  line.style.cssText = %(look)s;
  document.body.append(line);
})()"""
_SHOWN = (
    "position:fixed;top:0.6em;left:50%;transform:translateX(-50%);z-index:5;max-width:min(36em,90vw);"
    "padding:0.2em 0.7em;border-radius:4px;pointer-events:none;font-size:0.85em;background:#222;color:#fff"
)
_ONLY_READ = "position:fixed;width:1px;height:1px;overflow:hidden;clip-path:inset(50%);white-space:nowrap"
"""The look of the line for screen readers, which leave out what is hidden."""
_SAY = """(() => {
  const line = document.getElementById(%s);
  if (line) line.textContent = %s;
})()"""


def _names_and_colours() -> str:
    """JavaScript that adds names, language and style; it may run again for each scene."""
    names = _NAMES % tuple(map(json.dumps, (ROW, ICON_BUTTON, CLOSES_NOTICE, SCROLLS, CHART, FOLDED_PANEL)))
    return f"""(() => {{
document.documentElement.lang = "en";
const id = "himpc-lab-style";
const style = document.getElementById(id) ?? document.createElement("style");
style.id = id;
style.textContent = {json.dumps(STYLE)};
document.head.append(style);
{names}}})()"""


class Comfort:
    """The line that says what happens. If the user wants less motion, a page also begins paused."""

    def __init__(
        self, client: viser.ClientHandle, reduced: bool, window: tuple[int, int] | None = None
    ) -> None:
        """reduced: whether the user asked the browser for less motion; window: width and height of the
        browser's window, pixels, if known."""
        self._client, self._reduced, self.window = client, reduced, window
        self.says = False
        """Whether the line is on the screen. Screen readers always get it."""
        self._narration = Narration(time.monotonic)

    def opened(self, learner: SimulationClient) -> None:
        """Adds the line and the names for screen readers to a new scene, and pauses if the user wants less
        motion."""
        self._narration = Narration(time.monotonic)
        self._begin()
        private.run_script(self._client, _names_and_colours())
        if self._reduced:
            learner.send(Play(False))

    def add_switch(self, gui: viser.GuiApi) -> None:
        """Adds the checkbox that shows the line on the screen."""
        switch = gui.add_checkbox(
            "Say what happens",
            self.says,
            hint="A line above the robot, at most one sentence in two seconds. Screen readers always read it",
        )

        @switch.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client is not None:
                self.says = bool(switch.value)
                self._show("")
                self._begin()

    def follow(self, now: SessionSnapshot[SceneSettings]) -> None:
        """Shows a sentence about the events since the last call."""
        sentence = self._narration.look(facts_of(now))
        if sentence:
            self._show(sentence)

    def _begin(self) -> None:
        look = _SHOWN if self.says else _ONLY_READ
        private.run_script(self._client, _BEGIN % {"line": json.dumps(LINE), "look": json.dumps(look)})

    def _show(self, sentence: str) -> None:
        private.run_script(self._client, _SAY % (json.dumps(LINE), json.dumps(sentence)))


def window_size(told: str | None) -> tuple[int, int] | None:
    """Width and height of a window, pixels, from the text that a browser stored; None if the text is not
    valid."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", told or "")
    return None if found is None else (int(found[1]), int(found[2]))
