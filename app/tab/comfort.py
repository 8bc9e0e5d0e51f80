"""Help for people who use a screen reader, need contrast, or are disturbed by motion on the screen: names of
inputs and buttons, the language, and colours as WCAG 2.1 AA requires, and sentences about what happens."""

from __future__ import annotations

import json
import math
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from importlib.resources import files

import viser

from app.adapter import private
from app.adapter.names import CHART, CLOSES_NOTICE, FOLDED_PANEL, ICON_BUTTON, ROW, SCROLLS, STORED
from app.client.simulation_client import SimulationClient
from app.html.text import joints_named, quantity
from app.link.messages import Play

AT_MOST_EVERY = 2.0
"""Time, s, between two sentences."""
_STEADY = 0.1
"""An error counts as steady if it changes by less than this share between two checks."""
_WORTH = 2.0
"""An error is announced again if it has changed by at least this factor."""
_SMALL = {"m": 1e-3, "rad": math.radians(0.5)}
"""Errors below this value count as equal."""
_QUIET = 10.0
"""Time, s, during which the same active limit is not announced again."""
_GUARD = "lexicographic"
"""The kind of the rows of (11) and (12). One of them binds in almost every period; they are not announced."""


@dataclass(frozen=True)
class Facts:
    """The state of a session at one check.

    Attributes:
        running: whether simulated time passes.
        resets: number of resets so far.
        levels: (name, whether it is on), highest priority first.
        errors: for each task its error and the unit, m or rad.
        limits: active limits, as (kind, joint).
    """

    running: bool
    resets: int
    levels: tuple[tuple[str, bool], ...]
    errors: dict[str, tuple[float, str]]
    limits: frozenset[tuple[str, str]]


class Narration:
    """Compares each check with the previous one, and collects sentences until the next announcement."""

    def __init__(self, clock: Callable[[], float]) -> None:
        """clock: returns the time, s."""
        self._clock = clock
        self._before: Facts | None = None
        self._told: dict[str, float] = {}
        self._limits: dict[tuple[str, str], float] = {}
        self._waiting: list[str] = []
        self._next = -math.inf

    def look(self, now: Facts) -> str:
        """Returns the sentence that is due, with all events since the last sentence; "" if no sentence is
        due."""
        before, self._before = self._before, now
        if before is None:
            self._told = {name: error for name, (error, _) in now.errors.items() if math.isfinite(error)}
            self._waiting += [] if now.running else ["paused"]
        else:
            for sentence in (*_switched(before, now), *self._reached(now), *self._arrived(before, now)):
                if sentence not in self._waiting:
                    self._waiting.append(sentence)
        if not self._waiting or self._clock() < self._next:
            return ""
        self._next = self._clock() + AT_MOST_EVERY
        said = joints_named("; ".join(self._waiting[-4:]))
        self._waiting.clear()
        return said[0].upper() + said[1:] + "."

    def _reached(self, now: Facts) -> list[str]:
        """Returns active limits that were not announced recently."""
        t = self._clock()
        limits = sorted(each for each in now.limits if each[0] != _GUARD)
        new = [each for each in limits if t - self._limits.get(each, -math.inf) > _QUIET]
        self._limits.update(dict.fromkeys(now.limits, t))
        return [f"{kind} limit of {joint} is met" for kind, joint in new]

    def _arrived(self, before: Facts, now: Facts) -> list[str]:
        """Steady errors that differ from the last announced errors."""
        found = []
        for name, (error, unit) in now.errors.items():
            was, least = before.errors.get(name, (math.nan, unit))[0], _SMALL.get(unit, 0.0)
            told = self._told.setdefault(name, error) if math.isfinite(error) else error
            if not abs(error - was) <= max(_STEADY * was, 0.1 * least):
                continue
            if max(error, least) > _WORTH * max(told, least) or max(told, least) > _WORTH * max(error, least):
                self._told[name] = error
                found.append(f"{name} {quantity(error, unit)} from its target")
        return found


def _switched(before: Facts, now: Facts) -> list[str]:
    found = []
    if now.resets != before.resets:
        found.append("robot back at its start")
    if now.running != before.running:
        found.append("running" if now.running else "paused")
    was = dict(before.levels)
    for place, (name, on) in enumerate(now.levels, start=1):
        if was.get(name, on) != on:
            found.append(f"level {place}, {name}, switched {'on' if on else 'off'}")
    if [name for name, _ in now.levels] != [name for name, _ in before.levels]:
        found.append("the levels are now " + ", ".join(name for name, _ in now.levels))
    return found


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
canvas[data-engine] { background: linear-gradient(
  light-dark(#dfe7f0, #15171a), light-dark(#f4f7fa, #24272c) 45%, light-dark(#fff, #2a2d33)) }
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
NAME_TAB = """(() => {
  document.title = "himpc-lab";
  document.querySelector("link[rel=icon]").href = "data:image/svg+xml," + encodeURIComponent(%s);
})()""" % json.dumps(files("app.jupyter").joinpath("himpc-lab.svg").read_text("utf-8"))  # noqa: UP031
"""Gives the browser's tab the program's name and icon; without it they are viser's."""
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
    """JavaScript that adds names, language and style; it may run again."""
    names = _NAMES % tuple(map(json.dumps, (ROW, ICON_BUTTON, CLOSES_NOTICE, SCROLLS, CHART, FOLDED_PANEL)))
    return f"""(() => {{
document.documentElement.lang = "en";
const id = "himpc-lab-style";
const style = document.getElementById(id) ?? document.createElement("style");
style.id = id;
style.textContent = {json.dumps(STYLE)};
document.head.append(style);
{names}}})()"""


DARK = "himpc-lab-dark"
"""The key under which a browser stores whether the theme is dark."""


class Comfort:
    """The theme, and the line that says what happens. If the user wants less motion, a page also begins
    paused."""

    def __init__(
        self, client: viser.ClientHandle, reduced: bool, window: tuple[int, int] | None, dark: bool
    ) -> None:
        """reduced: whether the user asked the browser for less motion; window: width and height of the
        browser's window, pixels, if known; dark: whether the theme is dark."""
        self._client, self._reduced, self.window, self.dark = client, reduced, window, dark
        self.says = False
        """Whether the line is on the screen. Screen readers always get it."""
        self._narration = Narration(time.monotonic)

    def set_theme(self, dark: bool) -> None:
        """Shows the dark or the light theme, with which the browser opens its next page, too. Controls get
        their names for screen readers."""
        self.dark = dark
        self._client.gui.configure_theme(dark_mode=dark, show_share_button=False, show_logo=False)
        self._client.local_storage.set_item(DARK, "1" if dark else "0")
        private.run_script(self._client, _names_and_colours())

    def opened(self, learner: SimulationClient) -> None:
        """Adds the line that says what happens to a new scene, and pauses if the user wants less motion."""
        self._narration = Narration(time.monotonic)
        self._begin()
        if self._reduced:
            learner.send(Play(False))

    def add_switch(self, gui: viser.GuiApi) -> None:
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

    def follow(self, now: Facts) -> None:
        """Shows a sentence about the events since the last call."""
        sentence = self._narration.look(now)
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
