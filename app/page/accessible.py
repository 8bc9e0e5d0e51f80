"""Adds to viser's page what WCAG 2.1 AA requires: names of inputs and buttons, the language, and colours with
enough contrast."""

from __future__ import annotations

import json

from app.adapter.names import CHART, CLOSES_NOTICE, ICON_BUTTON, ROW, SCROLLS

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
const row = %s, icon = %s, closes = %s, scrolls = %s, chart = %s, key = "__himpcLabNames";
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


def script() -> str:
    """JavaScript that adds names, language and style; it may run again for each scene."""
    names = _NAMES % tuple(map(json.dumps, (ROW, ICON_BUTTON, CLOSES_NOTICE, SCROLLS, CHART)))
    return f"""(() => {{
document.documentElement.lang = "en";
const id = "himpc-lab-style";
const style = document.getElementById(id) ?? document.createElement("style");
style.id = id;
style.textContent = {json.dumps(STYLE)};
document.head.append(style);
{names}}})()"""
