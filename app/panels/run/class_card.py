"""The top of a learner's page in a class: the present activity of the class, and the learner's name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import Any

import viser

from app.html.palette import GOOD, LEVELS, css
from app.html.text import bar, block, esc
from app.panels.widgets.command import on_click

_SAYS = {
    "waiting": "The vote is not open yet.",
    "open": "<b>Vote:</b> enter below what you expect; you can change it until the vote is closed.",
    "again": "<b>Second vote:</b> discuss the question. Your prediction below counts; you can change it.",
    "closed": "The vote is closed.",
    "running": "The step runs.",
    "decided": "",
}
_NAME = "Your name"


class ClassCard:
    """The card. The server calls `show` whenever the view of the class changes."""

    def __init__(
        self, gui: viser.GuiApi, name: str, call: Callable[[str], object] | None, fetch: Callable[[], object]
    ) -> None:
        """name: the name with which the learner signed in, or the name typed before; call: receives a new
        name; None if no name is requested; fetch: opens the step of the class on this page."""
        self._text = gui.add_html(block("<b>Class.</b> Wait for your teacher."))
        self._back = gui.add_button("Go to the class's step", visible=False)
        on_click(self._back, fetch)
        if call is None and name:
            gui.add_html(block(f"Your teacher sees your account, <b>{esc(name)}</b>."))
        elif call is not None:
            typed = gui.add_text(_NAME, name, hint="Only your teacher sees your name. It is optional.")

            @typed.on_update
            async def _(_: object) -> None:
                call(str(typed.value))

    def show(self, view: Mapping[str, Any]) -> None:
        """Shows a view of the class: the result of `app.classes.views.for_all` with more fields. `away`:
        whether this page is at another step; `vote`: address of a page for voting, for pages without their
        own robot; `before`: number of learners who get their robot earlier, None if this page has its
        robot."""
        self._text.content = _html(view)
        if self._back.visible != view["away"]:
            self._back.visible = view["away"]


def _html(view: Mapping[str, Any]) -> str:
    if not view["title"]:
        return block("<b>Class.</b> Your teacher has not chosen a step yet.")
    stage = "again" if view["stage"] == "open" and view["round"] > 1 else view["stage"]
    says = _SAYS[stage] if view["asked"] or stage not in ("waiting", "open") else ""
    if view["vote"] and stage in ("open", "again"):
        link = f'<a href="{esc(view["vote"])}" target="_blank" rel="noopener">on the page for phones</a>'
        says = f"<b>Vote</b> {link}."
    lines = [
        f"<b>Class:</b> {esc(view['title'])}",
        _coming(view["before"]),
        says,
        _bars(view["rounds"][-1:]),
        esc(view["result"]),
    ]
    html = "".join(f"<div>{line}</div>" for line in lines if line)
    return block(html, f"border-left:3px solid {css(LEVELS[1])};margin:0.3em 0")


def _coming(before: int | None) -> str:
    if not before:
        return "" if before is None else "Your robot will be at this step soon."
    return f"Your robot will be at this step soon. Robots before it: {before}."


def _bars(rounds: list[list[Mapping[str, Any]]]) -> str:
    if not rounds:
        return ""
    most = max(1, *(each["count"] for each in rounds[0]))
    return "".join(
        f"<div>{'<b>' + each['letter'] + '</b> ' if each['letter'] else ''}{each['label']}: {each['count']}"
        f"{' <b>✓ measured</b>' if each['right'] else ''}"
        f"{bar(each['count'] / most, GOOD if each['right'] else LEVELS[1])}</div>"
        for each in rounds[0]
    )
