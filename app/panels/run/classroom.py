"""The top of a page that only watches: an explanation, and an input for the instructor's token."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import viser

from app.html.text import block

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
