"""The learner's progress in the lessons, as a text to hand in."""

from __future__ import annotations

from html import escape

import viser

from app.client.progress import Notebook
from app.client.simulation_client import SimulationClient
from app.html.text import block
from lessons.replay.progress import LONGEST_NAME


def add_hand_in(gui: viser.GuiApi, learner: SimulationClient, notebook: Notebook) -> None:
    """Adds the folder with which learners hand in their progress. The text to hand in is written when the
    learner asks for it, on one of viser's threads."""
    with gui.add_folder("Hand in your progress", expand_by_default=False):
        told = f" The text names your account, <b>{escape(notebook.account)}</b>." if notebook.account else ""
        gui.add_html(block((_SIGNED if notebook.signs else _NOT_SIGNED) + told))
        name = gui.add_text("Your name", notebook.account[:LONGEST_NAME])
        make = gui.add_button("Write the text")
        text = gui.add_text("To hand in", "", multiline=True, visible=False)

    @make.on_click
    def _(_: object) -> None:
        text.visible = False
        # An uploaded robot has no code; the text still contains the progress.
        text.value = notebook.to_hand_in(str(name.value).strip()[:LONGEST_NAME], learner.code)
        text.visible = True


_WHAT = (
    "The text lists the lessons whose steps you ran, the best scores of their challenges, and the code of "
    "the present setting. Copy the text and send it; <code>himpc-lab grade FILE.txt</code> reads it."
)
_SIGNED = f"{_WHAT} This lab signs the text with its instructor's key."
_NOT_SIGNED = f"{_WHAT} This lab has no instructor's key, so anybody could have written the text."
