"""The lessons in one page: the tab of the active step, the invitation, and the list of lessons."""

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
from app.panels.widgets.window import PopupWindow
from lessons.settings.settings import SceneSettings


class Course:
    """The lessons of a page, built anew for every scene. The tab of a lesson comes first, since the learner
    opened the page for this lesson."""

    def __init__(
        self,
        gui: viser.GuiApi,
        learner: SimulationClient,
        exercise: LessonPlace | None,
        notebook: Notebook,
        choose: Callable[[SceneChoice], None],
        settings: Callable[[], SceneSettings],
        loop: asyncio.AbstractEventLoop,
    ) -> None:
        """exercise: the active step, if there is one."""
        self._gui, self._learner, self._notebook = gui, learner, notebook
        self._exercise = exercise
        self._choose, self._settings, self._loop = choose, settings, loop
        self._list = PopupWindow(gui, "All lessons", "L", self._fill)
        self._panel: LessonPanel | None = None
        if exercise is None:
            add_invitation(gui, notebook, choose)

    def add_first_tabs(
        self, tabs: viser.GuiTabGroupHandle, plots: viser.PanelHandle | viser.GuiTabGroupHandle
    ) -> None:
        """Adds the tab of the active step, and its curves to the plots."""
        gui, exercise = self._gui, self._exercise
        if exercise is None:
            return
        lesson = tabs.add_tab("Lesson")
        with plots.add_tab("This step"):
            pictures = gui.add_html("")
        self._panel = LessonPanel(
            gui,
            lesson,
            pictures,
            exercise,
            self._learner,
            self._choose,
            self._list.open,
            self._notebook,
            self._settings,
            self._loop,
        )

    def add_last_tab(self, tabs: viser.GuiTabGroupHandle) -> None:
        """Adds the list of lessons, if no lesson is active."""
        if self._panel is None:
            with tabs.add_tab("Lessons"):
                self._fill()

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
