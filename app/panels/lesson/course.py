"""The lessons in one page: the active step, the invitation, and the list of lessons."""

from __future__ import annotations

import asyncio
from collections.abc import Callable

import viser

from app.client.progress import Notebook
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace
from app.panels.lesson.cards import add_cards, add_invitation, exercise_cards
from app.panels.lesson.step import LessonPanel
from app.panels.widgets.command import on_click
from app.panels.widgets.window import PopupWindow
from lessons.settings.settings import SceneSettings


class Course:
    """The lessons of a page, built anew for every scene. In a lesson the first tab has its step, otherwise a
    button that leads to the next lesson."""

    def __init__(
        self,
        gui: viser.GuiApi,
        learner: SimulationClient,
        exercise: LessonPlace | None,
        notebook: Notebook,
        choose: Callable[[SceneChoice], None],
        settings: Callable[[], SceneSettings],
        loop: asyncio.AbstractEventLoop,
        plots: viser.PanelHandle | viser.GuiTabGroupHandle | None,
    ) -> None:
        """exercise: the active step, if there is one; plots: gets a tab with the curves of the step. If it
        is None, the curves are in the panel of the step."""
        self._gui, self._notebook, self._choose = gui, notebook, choose
        self._list = PopupWindow(gui, "All lessons", "L", self._fill)
        self._panel: LessonPanel | None = None
        if exercise is None:
            add_invitation(gui, notebook, choose)
            on_click(gui.add_button("All lessons", hint="Key L"), self._list.open)
            return
        pictures = None
        if plots is not None:
            with plots.add_tab("This step"):
                pictures = gui.add_html("")
        tab = gui.add_folder(None)
        self._panel = LessonPanel(
            gui, tab, pictures, exercise, learner, choose, self._list.open, notebook, settings, loop
        )

    def _fill(self) -> None:
        add_cards(self._gui, self._notebook, self._leave_for)
        self._gui.add_html(exercise_cards())

    def _leave_for(self, choice: SceneChoice) -> None:
        self._list.close()
        self._choose(choice)

    def follow(self, lecture: Lecture | None, settings: SceneSettings) -> None:
        """Updates the progress of the lesson."""
        if self._panel is not None:
            self._panel.follow(lecture, settings)

    def close(self) -> None:
        """Closes the list and the panel before the page removes them."""
        self._list.close()
        if self._panel is not None:
            self._panel.close()
