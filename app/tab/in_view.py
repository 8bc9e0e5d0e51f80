"""Finds out which charts the browser shows, so that no data are sent for other charts."""

from __future__ import annotations

import json
from collections.abc import Mapping

import viser

from app.adapter import private
from app.adapter.names import CHART, CHART_TITLE, PAGE

LABEL = "Charts in view"
"""Label of the hidden control through which the browser reports."""
AWAKE, ASLEEP = "(awake)", "(asleep)"
_LONGEST = 4000  # number of characters that are read

# Charts are identified by their titles. An observer notices if a tab, a folded panel or scrolling hides a
# chart. A page in a hidden tab shows no charts. Charts appear and disappear with viser's tabs, so the script
# checks regularly.
_SCRIPT = """
const control = %s, awake = %s, asleep = %s, charts = %s, title = %s;
const viser = () => %s, key = "__himpcLabInView";
window[key]?.();
const shown = new Map();
let said = null;
const tell = () => {
  const titles = new Set([awake]);
  for (const [chart, on] of shown)
    if (on && chart.isConnected)
      titles.add(chart.dataset.chart ?? chart.querySelector(title)?.textContent ?? "");
  const value = document.hidden ? asleep : [...titles].sort().join("\\n");
  if (value === said || !viser()) return;
  said = value;
  viser().sendMessage({ type: "GuiUpdateMessage", uuid: control, updates: { value } });
};
const observer = new IntersectionObserver((entries) => {
  for (const entry of entries) if (shown.has(entry.target)) shown.set(entry.target, entry.isIntersecting);
  tell();
});
const look = () => {
  for (const chart of document.querySelectorAll(charts))
    if (!shown.has(chart)) { shown.set(chart, false); observer.observe(chart); }
  for (const chart of shown.keys())
    if (!chart.isConnected) { shown.delete(chart); observer.unobserve(chart); }
  tell();
};
const soon = () => setTimeout(look, 30);
const timer = setInterval(look, 250);
document.addEventListener("visibilitychange", look);
document.addEventListener("click", soon, true);
window[key] = () => {
  clearInterval(timer);
  observer.disconnect();
  document.removeEventListener("visibilitychange", look);
  document.removeEventListener("click", soon, true);
};
look();
"""


def tells_what_is_seen(updates: object) -> bool:
    """Returns whether a write to a control comes from this script, not from a user."""
    value = updates.get("value") if isinstance(updates, Mapping) else None
    return isinstance(value, str) and value.partition("\n")[0] in (AWAKE, ASLEEP)


class InView:
    """The visible charts. Until the browser has reported, all charts count as visible."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._told = client.gui.add_text(LABEL, "", visible=False)
        self._titles: frozenset[str] | None = None
        self.asleep = False

        @self._told.on_update
        async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
            if event.client is not None:
                self._hear(self._told.value)

        words = private.dom_id(self._told), AWAKE, ASLEEP, f"{CHART}, [data-chart]", CHART_TITLE
        private.run_script(client, _SCRIPT % (*map(json.dumps, words), PAGE))

    def _hear(self, told: str) -> None:
        told = told[:_LONGEST]
        self.asleep = told == ASLEEP
        self._titles = frozenset(told.split("\n"))

    @property
    def told(self) -> bool:
        """Whether the browser has reported."""
        return self._titles is not None

    def sees(self, title: str) -> bool:
        """Returns whether a chart with this title is visible."""
        return self._titles is None or title in self._titles
