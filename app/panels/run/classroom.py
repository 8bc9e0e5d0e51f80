"""What a page says that only watches, and where the instructor gives the token."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.html.text import block


def add_watching(gui: viser.GuiApi, give: Callable[[str], bool]) -> None:
    """At the top of the panel of a page in a classroom.

    Args:
        gui: where.
        give: takes a token and returns whether it was the right one.
    """
    gui.add_html(
        block(
            "<b>Classroom: you are watching.</b> The instructor steers this robot; the view, the "
            "tabs and the plots are yours."
        )
    )
    token = gui.add_text("Instructor's token", "", hint="Printed where himpc-lab was started.")
    wrong = gui.add_html("", visible=False)

    @token.on_update
    def _(event: viser.GuiEvent[viser.GuiTextHandle]) -> None:
        given = token.value.strip()
        if event.client is None or not given or give(given):
            return
        wrong.content = block("That is not the token.")
        wrong.visible = True
