"""The tab Export: downloads of rows and plots; the setting as a command line, a state code and a script; and
the learner's progress, to hand in."""

from __future__ import annotations

import tempfile
from collections.abc import Callable
from html import escape
from pathlib import Path

import numpy as np
import viser

from app.client.recording import RATE
from app.client.simulation import Simulation
from app.html.text import block
from app.link.choice import SceneChoice
from app.link.messages import RunDescription
from app.tab.context import PageContext
from lessons.plots.recorded import Recorded, run_picture
from lessons.recording.arrays import as_csv, as_npz, named
from lessons.replay.progress import LONGEST_NAME
from lessons.replay.script import script
from lessons.replay.state import State, decode, encode, state_of
from robots import InputError

_MINUTE, _WHOLE = "the last minute", "all since the last reset"


class ExportPanel:
    """The panel of downloads. Files are made from the recorded data, on viser's threads and without the
    simulation."""

    def __init__(self, page: PageContext) -> None:
        gui, self._page, self._learner = page.gui, page, page.learner
        gui.add_html(_DOWNLOAD)
        self._span = gui.add_dropdown("Of", (_MINUTE, _WHOLE), initial_value=_MINUTE)
        for label, make, hint in (
            ("Rows as .npz", self._npz, "NumPy arrays with the same names as from himpc-lab run --npz"),
            ("Rows as .csv", self._csv, "One line per row, for a spreadsheet; SI units"),
            (
                "Plots as .png",
                self._png,
                "Errors, joints with their bounds, and computing time; curves of the ghost are dashed",
            ),
        ):
            self._button(gui, label, make, hint)

    def _button(
        self, gui: viser.GuiApi, label: str, make: Callable[[], tuple[str, bytes] | None], hint: str
    ) -> None:
        button = gui.add_button(label, hint=hint)

        @button.on_click
        def _(_: object) -> None:  # on a thread, as it takes seconds
            made = make()
            if made is None:
                self._page.notify("Nothing recorded yet", "Let the robot run first.")
            else:
                self._page.client.send_file_download(*made, save_immediately=True)

    def _rows(self, simulation: Simulation) -> Recorded | None:
        minute = self._span.value == _MINUTE
        # Within `read`, the page's loop cannot add rows.
        run = simulation.read(
            lambda recording: Recorded(recording.layout, recording.minute() if minute else recording.whole())
        )
        return None if run is None or len(run.rows) < 2 else run

    def _name(self, ending: str) -> str:
        return f"{self._learner.choice.run.scene}-{self._page.settings.controller}.{ending}"

    def _npz(self) -> tuple[str, bytes] | None:
        run, ready = self._rows(self._learner), self._learner.ready
        if run is None or ready is None:
            return None
        spec, gap = self._learner.choice.run, np.diff(run["t"][:, 0])
        how = {
            "scene": spec.scene,
            "urdf": spec.urdf,
            "tip": spec.tip,
            "hold": list(spec.hold),
            "seed": spec.seed,
            "rows_per_second": float(1 / np.median(gap)),
        }
        return self._name("npz"), as_npz(named(ready.robot, self._page.settings, run.layout, run.rows, how))

    def _csv(self) -> tuple[str, bytes] | None:
        run = self._rows(self._learner)
        return None if run is None else (self._name("csv"), as_csv(run.layout, run.rows))

    def _png(self) -> tuple[str, bytes] | None:
        run = self._rows(self._learner)
        if run is None:
            return None
        from lessons.plots.draw import draw  # late, as few pages make plots, and Matplotlib is large

        ghost = self._learner.ghost
        beside = None if ghost is None else self._rows(ghost)
        name = self._name("png")
        with tempfile.TemporaryDirectory() as folder:
            picture = run_picture(name.removesuffix(".png"), run, beside, self._page.settings.T_s)
            return name, draw(picture, Path(folder)).read_bytes()


_DOWNLOAD = block(
    f"<b>Download the run.</b> The page stores up to {RATE:g} rows per second, each exactly as the "
    "simulation wrote it. Of a long run, the page stores every second, fourth, … of these rows.",
    "padding-top:0.5em",
)


def add_hand_in(page: PageContext) -> None:
    """Adds the folder with which learners hand in their progress. The text to hand in is written when the
    learner asks for it, on one of viser's threads."""
    gui, learner, notebook = page.gui, page.learner, page.visitor.notebook
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


class SharePanel:
    """The panel of texts, which are made on request, on viser's threads."""

    def __init__(self, page: PageContext) -> None:
        gui, self._page = page.gui, page
        with gui.add_folder("Share the setting"):
            gui.add_html(_SHARE)
            make = gui.add_button("Write it down")
            self._line = gui.add_text("Command line", "", multiline=True, visible=False)
            self._code = gui.add_text("Code", "", multiline=True, visible=False)
            save = gui.add_button(
                "Script as .py", hint="Repeats the run since the last reset with its events, to the last bit"
            )
            given = gui.add_text("Somebody's code", "", hint="Same as himpc-lab --state CODE")
            take = gui.add_button("Open it")

        # On threads: the simulation may answer late, and opening a code loads a scene twice.
        make.on_click(lambda _: self._try(self._write))
        save.on_click(lambda _: self._try(self._save))
        take.on_click(lambda _: self._try(lambda: self._open(str(given.value))))

    def _try(self, do: Callable[[], None]) -> None:
        try:
            do()
        except InputError as error:
            self._page.notify("That does not work", str(error))

    def _run(self) -> RunDescription:
        told = self._page.learner.ask()
        if told is None:
            raise InputError("the simulation does not answer: press Reset all, then try again")
        return told

    def _open(self, code: str) -> None:
        self._page.choose(SceneChoice.of_state(decode(code)))

    def _write(self) -> None:
        state = state_now(self._run())
        self._line.value = state.run.command_line()
        self._line.visible = True
        self._code.visible = False
        self._code.value = encode(state)
        self._code.visible = True

    def _save(self) -> None:
        told = self._run()
        run = refuse_uploaded_robot(told.choice).run
        text = script(run, told.log, told.t)
        self._page.client.send_file_download(f"{run.scene}.py", text.encode(), save_immediately=True)


_SHARE = block(
    "Scene, robot, controller and every changed setting, as a command line for a terminal and as a code for "
    "another page. The script also repeats the events since the last reset."
)


def state_now(told: RunDescription) -> State:
    """Returns the state of the setting on a page. Raises InputError for a robot that was uploaded."""
    choice = refuse_uploaded_robot(told.choice)
    exercise = choice.exercise
    return state_of(
        choice.run,
        told.settings,
        lesson=None if exercise is None else exercise.lesson,
        step=None if exercise is None else exercise.place + 1,
    )


def refuse_uploaded_robot(choice: SceneChoice) -> SceneChoice:
    """Returns the choice unchanged. Raises InputError if its robot was uploaded."""
    if choice.urdf_text is not None:
        raise InputError(
            "a code cannot contain this robot, which was uploaded: save its file and "
            "start himpc-lab with --urdf"
        )
    return choice
