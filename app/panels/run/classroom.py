"""The top of a page in a class: the present activity, the learner's name, and, on a page that only watches,
an input for the instructor's token."""

from __future__ import annotations

import asyncio
from collections.abc import Callable, Mapping
from typing import Any

import viser

from app.html.palette import GOOD, LEVELS, css
from app.html.text import bar, block, esc
from app.panels.widgets.command import on_change, on_click

BETWEEN = 1.0
"""Time, s, between two attempts of one page. Only this page waits, not other pages or the server."""


class Guesses:
    """The attempts of one page to enter the token. At most one attempt every BETWEEN s is checked; of several
    attempts within this time, only the last one counts."""

    def __init__(self, give: Callable[[str], bool]) -> None:
        self._give = give
        self._next = -float("inf")
        self._latest: str | None = None
        self._waiting = False

    async def offer(self, token: str) -> bool | None:
        """Returns whether the latest token is right. Returns None if an earlier attempt is still waiting;
        that attempt then checks the latest token."""
        self._latest = token
        if self._waiting:
            return None
        self._waiting = True
        clock = asyncio.get_running_loop().time
        try:
            await asyncio.sleep(max(0.0, self._next - clock()))
        finally:
            self._waiting = False
        self._next = clock() + BETWEEN
        return self._give(self._latest)


def add_watching(gui: viser.GuiApi, give: Callable[[str], bool]) -> None:
    """Adds the top of the panel for a page in a classroom.

    Args:
        gui: the page's controls.
        give: receives a token and returns whether it is right.
    """
    gui.add_html(
        block(
            "<b>Classroom: you are watching.</b> Only the instructor can control this robot; you can change "
            "the view, the tabs and the plots of your page."
        )
    )
    token = gui.add_text("Instructor's token", "", hint="himpc-lab printed the token in its terminal.")
    wrong = gui.add_html("", visible=False)
    guesses = Guesses(give)

    @token.on_update
    async def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
        given = token.value.strip()
        if event.client is None or not given or await guesses.offer(given) is not False:
            return
        wrong.content = block("That is not the token.")
        wrong.visible = True


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
            on_change(typed, lambda: call(str(typed.value)))

    def show(self, view: Mapping[str, Any]) -> None:
        """Shows a view of the class: the result of `app.classes.views.for_all` with more fields. `away`:
        whether this page is at another step; `vote`: address of a page for voting, for pages without their
        own robot; `before`: number of learners who get their robot earlier, None if this page has its
        robot."""
        self._text.content = _html(view)
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
