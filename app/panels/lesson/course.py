"""The lessons in one page: the active step, the invitation, and the list of lessons."""

from __future__ import annotations

import viser

from app.client.progress import Notebook
from app.link.choice import SceneChoice
from app.link.exercise import Lecture
from app.panels.context import PageContext
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
        page: PageContext,
        notebook: Notebook,
        plots: viser.PanelHandle | viser.GuiTabGroupHandle | None,
    ) -> None:
        """plots: gets a tab with the curves of the step. If it
        is None, the curves are in the panel of the step."""
        gui, exercise = page.gui, page.learner.choice_of(page.ready).exercise
        self._page, self._notebook = page, notebook
        self._list = PopupWindow(gui, "All lessons", "L", self._fill)
        self._panel: LessonPanel | None = None
        if exercise is None:
            add_invitation(gui, notebook, page.choose)
            on_click(gui.add_button("All lessons", hint="Key L"), self._list.open)
            return
        pictures = None
        if plots is not None:
            with plots.add_tab("This step"):
                pictures = gui.add_html("")
        tab = gui.add_folder(None)
        self._panel = LessonPanel(page, tab, pictures, exercise, self._list.open, notebook)

    def _fill(self) -> None:
        add_cards(self._page.gui, self._notebook, self._leave_for)
        self._page.gui.add_html(exercise_cards())

    def _leave_for(self, choice: SceneChoice) -> None:
        self._list.close()
        self._page.choose(choice)

    def follow(self, lecture: Lecture | None, settings: SceneSettings) -> None:
        """Updates the progress of the lesson."""
        if self._panel is not None:
            self._panel.follow(lecture, settings)

    def close(self) -> None:
        """Closes the list and the panel before the page removes them."""
        self._list.close()
        if self._panel is not None:
            self._panel.close()
