"""The setting as a command line, a state code and a script; and an input for a state code."""

from __future__ import annotations

from collections.abc import Callable

import viser

from app.client.state_code import refuse_uploaded_robot, state_now
from app.html.text import block
from app.link.choice import SceneChoice
from app.link.messages import RunDescription
from app.panels.context import PageContext
from lessons.replay.script import script
from lessons.replay.state import decode, encode
from robots import InputError


class SharePanel:
    """The panel of texts, which are made on request, on viser's threads."""

    def __init__(self, page: PageContext) -> None:
        gui, self._learner = page.gui, page.learner
        with gui.add_folder("Share the setting"):
            gui.add_html(_INTRO)
            make = gui.add_button("Write it down")
            self._line = gui.add_text("Command line", "", multiline=True, visible=False)
            self._code = gui.add_text("Code", "", multiline=True, visible=False)
            save = gui.add_button(
                "Script as .py", hint="Repeats the run since the last reset with its events, to the last bit"
            )
            given = gui.add_text("Somebody's code", "", hint="Same as himpc-lab --state CODE")
            take = gui.add_button("Open it")

        @make.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            self._try(event.client, self._write)

        @save.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:
            client = event.client
            if client is not None:
                self._try(client, lambda told: self._save(client, told))

        @take.on_click
        def _(event: viser.GuiEvent[viser.GuiButtonHandle]) -> None:  # on a worker: a scene is loaded twice
            try:
                page.choose(SceneChoice.of_state(decode(str(given.value))))
            except InputError as error:
                _refuse(event.client, error)

    def _try(self, client: viser.ClientHandle | None, make: Callable[[RunDescription], None]) -> None:
        told = self._learner.ask()
        try:
            if told is None:
                raise InputError("the simulation does not answer: press Reset all, then try again")
            make(told)
        except InputError as error:
            _refuse(client, error)

    def _write(self, told: RunDescription) -> None:
        state = state_now(told)
        self._line.value = state.run.command_line()
        self._line.visible = True
        self._code.visible = False
        self._code.value = encode(state)
        self._code.visible = True

    def _save(self, client: viser.ClientHandle, told: RunDescription) -> None:
        choice = refuse_uploaded_robot(told.choice)
        text = script(choice.run, told.log, told.t)
        client.send_file_download(f"{choice.run.scene}.py", text.encode(), save_immediately=True)


def _refuse(client: viser.ClientHandle | None, error: InputError) -> None:
    if client is not None:
        client.add_notification("That does not work", str(error), color="orange", auto_close_seconds=10.0)


_INTRO = block(
    "Scene, robot, controller and every changed setting, as a command line for a terminal and as a code for "
    "another page. The script also repeats the events since the last reset."
)
