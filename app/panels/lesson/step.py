"""The lessons in the first tab: one step at a time, with its idea, its prediction, its run and the results;
and the list of lessons."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import viser

from app.html.palette import LEVELS, button
from app.link.choice import SceneChoice
from app.link.exercise import Lecture, LessonPlace, parts_of
from app.link.messages import Predict, ResetAll, RunStep
from app.link.threads import on_thread
from app.panels.lesson.cards import add_cards, add_invitation, belonging_to, exercise_cards
from app.panels.lesson.claims import heading, idea, now_you, pictures, state, why
from app.panels.lesson.prediction import Asking
from app.panels.widgets.command import PopupWindow, add_command, on_click
from app.panels.widgets.controls import add_control
from app.tab.context import PageContext
from app.tab.mirror import Bindings
from lessons.settings.settings import SceneSettings
from lessons.teaching.lesson import Challenge, Step

_AGAIN, _MINE, _RESET = "Run again", "With my knobs", "Reset"
_BACK, _SKIP, _ALL = "◀ Back", "Skip ▶", "All lessons"


class LessonPanel:
    """The panel of a step. It is rebuilt for every step; its tab remains. Callbacks only send commands."""

    def __init__(
        self,
        page: PageContext,
        tab: viser.GuiFolderHandle,
        pictures: viser.GuiHtmlHandle | None,
        exercise: LessonPlace,
        all_lessons: Callable[[], None],
    ) -> None:
        """pictures: where the curves of the run are drawn. If it is None, as on a phone, they are drawn here
        below the answers, and the idea follows."""
        self._page, self._tab, self._far = page, tab, pictures
        self._all_lessons = all_lessons
        self._fast, self._beside = False, page.learner.shows_ghosts
        self._turn_to(exercise)
        for label, key, does in (
            ("Lesson: run this step", "P", self.run),
            ("Lesson: next step", "N", self.next),
            ("Lesson: previous step", "B", self.back),
        ):
            add_command(page.gui, label, key, does)

    # ---------------------------------------------------------------- building

    def _turn_to(self, exercise: LessonPlace) -> None:
        self._exercise, self._part = exercise, exercise.part
        self._lecture: Lecture | None = None
        self._arrived = True
        last = exercise.place + 1 >= len(parts_of(exercise.whole))
        self._exercises = belonging_to(exercise.lesson) if last else ""
        self._bindings: Bindings[SceneSettings] = Bindings(self._page.post, self._page.loop)
        with self._tab:
            self._all = self._page.gui.add_folder(None)
        with self._all:
            self._build()

    def _build(self) -> None:
        gui, part = self._page.gui, self._part
        gui.add_html(heading(self._exercise))
        if self._far is not None:
            self._idea = gui.add_html("")
        prediction = part.prediction if isinstance(part, Step) else None
        self._asking = None if prediction is None else Asking(gui, prediction, self._page.send)
        if isinstance(part, Challenge):
            with gui.add_folder("Your knobs"):
                for knob in part.knobs:
                    add_control(gui, self._bindings, knob, self._page.settings)
        self._run = gui.add_button("Run this step", color=button(LEVELS[1]), hint="Key P")
        self._hurry = gui.add_checkbox(
            "As fast as possible", self._fast, hint="Faster than real time, if you have seen the run before"
        )
        self._pictures = self._far or gui.add_html("")
        if self._far is None:
            self._idea = gui.add_html("")
        self._state = gui.add_html("")
        self._why = gui.add_html("")
        self._now_you = gui.add_html("")
        self._free = gui.add_folder("Your knobs", visible=False)
        with self._free:
            if isinstance(part, Step):
                for control in part.controls:
                    add_control(gui, self._bindings, control, self._page.settings)
            self._rerun = gui.add_button_group(
                "Script", (_AGAIN, _MINE, _RESET), hint="The run of this step, with its own settings or yours"
            )
        self._second = gui.add_checkbox(
            "Ghost",
            self._beside,
            visible=isinstance(part, Step) and part.ghost is not None,
            hint="Shows the second robot, translucent, in the same scene. Both robots start again together.",
        )
        self._next = gui.add_button(self._next_label(), color=button(LEVELS[2]), visible=False, hint="Key N")
        self._where = gui.add_button_group("Lesson", (_BACK, _SKIP, _ALL), hint="Keys B, N and L")
        self._listen()

    def _listen(self) -> None:
        on_click(self._run, self.run)

        @self._hurry.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client is not None:
                self._fast = bool(self._hurry.value)

        @self._second.on_update
        def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:  # on a thread, as it starts processes
            if event.client is not None:
                self._beside = bool(self._second.value)
                self._show_ghost_on_thread()

        on_click(self._next, self.next)

        @self._rerun.on_click
        async def _(_: object) -> None:
            choice = str(self._rerun.value)
            self._page.send(
                ResetAll() if choice == _RESET else RunStep(own=choice == _AGAIN, fast=self._fast)
            )

        on_click(
            self._where,
            lambda: {_BACK: self.back, _SKIP: self.next, _ALL: self._all_lessons}[str(self._where.value)](),
        )

    def _begin_with_ghost(self, lecture: Lecture) -> None:
        """Starts or stops the ghost when the learner comes to a step. A ghost that starts later would put the
        robot back to its start."""
        if lecture.phase == "waiting" and self._page.learner.shows_ghosts:
            on_thread("ghost", self._show_ghost_on_thread)

    def _show_ghost_on_thread(self) -> None:
        """Starts the ghost of this step in the scene if the learner has not hidden it; otherwise stops the
        ghost."""
        ghost = self._part.ghost if isinstance(self._part, Step) else None
        if ghost is not None and self._beside:
            self._page.learner.start_ghost(ghost)
        elif self._page.learner.ghost is not None:
            self._page.learner.stop_ghost()

    def _next_label(self) -> str:
        lesson = self._exercise.whole
        parts = parts_of(lesson)
        if self._exercise.place + 1 >= len(parts):
            return "Next: choose another lesson"
        after = parts[self._exercise.place + 1]
        return f"Next: {after.title if isinstance(after, Step) else 'the challenge'}"

    # ---------------------------------------------------------------- doing

    def run(self) -> None:
        lecture, asking = self._lecture, self._asking
        if asking is not None and lecture is not None and lecture.answer is None:
            suggested = asking.suggested
            if suggested is not None:
                self._page.send(Predict(suggested))
        self._page.send(RunStep(own=True, fast=self._fast))

    def next(self) -> None:
        """Opens the next step; after the last step, the list of lessons."""
        if self._exercise.place + 1 >= len(parts_of(self._exercise.whole)):
            self._all_lessons()
        else:
            self._go(self._exercise.place + 1)

    def back(self) -> None:
        """Opens the previous step, if there is one."""
        if self._exercise.place > 0:
            self._go(self._exercise.place - 1)

    def _go(self, place: int) -> None:
        self._page.choose(self._page.learner.choice.at(replace(self._exercise, place=place)))

    # ---------------------------------------------------------------- showing

    def follow(self, lecture: Lecture | None, settings: SceneSettings) -> None:
        if lecture is None:
            return
        if lecture.exercise != self._exercise:
            self._bindings.close()
            self._all.remove()
            self._turn_to(lecture.exercise)
        if self._arrived:
            self._arrived = False
            self._begin_with_ghost(lecture)
        if lecture is not self._lecture:
            self._lecture = lecture
            self._note(lecture)
            self._show(lecture)
        self._bindings.refresh(settings)

    def _note(self, lecture: Lecture) -> None:
        if lecture.phase != "done":
            return
        name, notebook = self._exercise.lesson, self._page.visitor.notebook
        progress = notebook.progress
        if isinstance(self._part, Step):
            progress = progress.with_step(name, self._exercise.place)
        elif lecture.result is not None and lecture.result.passed and not lecture.changed:
            progress = progress.with_step(name, self._exercise.place).with_points(name, lecture.result.score)
        notebook.note(progress)

    def _show(self, lecture: Lecture) -> None:
        seen = lecture.attempt > 0
        over = lecture.phase == "done"
        challenge = isinstance(self._part, Challenge)
        # After a missed goal, the button offers another attempt; Skip continues without an attempt.
        passed = lecture.result is not None and lecture.result.passed
        if self._asking is not None:
            self._asking.show(lecture)
        ready = self._asking is None or lecture.answer is not None or self._asking.suggested is not None
        label = "Start the run" if challenge else "Run this step" if ready else "Run (answer first)"
        self._run.label = label
        for handle, shown in (
            (self._run, challenge or lecture.phase == "waiting"),
            (self._hurry, challenge or lecture.phase == "waiting"),
            (self._next, over and (passed or not challenge)),
            (self._free, over and not challenge),
        ):
            handle.visible = shown
        busy = lecture.phase in ("preparing", "running")
        self._run.disabled = busy or not ready
        best = self._page.visitor.notebook.progress.best.get(self._exercise.lesson)
        self._idea.content = idea(self._part, opened=not seen)
        self._state.content = state(self._part, lecture, best)
        if self._far is not None or lecture.curves:
            self._pictures.content = pictures(self._part, lecture)
        self._why.content = why(self._part) if over else ""
        self._now_you.content = now_you(self._part, lecture) + self._exercises if over else ""

    def close(self) -> None:
        """Stops all updates before the controls are removed."""
        self._bindings.close()


class Course:
    """The lessons of a page, built anew for every scene. In a lesson the first tab has its step, otherwise a
    button that leads to the next lesson."""

    def __init__(self, page: PageContext, plots: viser.PanelHandle | viser.GuiTabGroupHandle | None) -> None:
        """plots: gets a tab with the curves of the step. If it
        is None, the curves are in the panel of the step."""
        gui, exercise = page.gui, page.learner.choice_of(page.ready).exercise
        self._page = page
        self._list = PopupWindow(gui, "All lessons", "L", self._fill)
        self._panel: LessonPanel | None = None
        if exercise is None:
            add_invitation(page)
            on_click(gui.add_button("All lessons", hint="Key L"), self._list.open)
            return
        pictures = None
        if plots is not None:
            with plots.add_tab("This step"):
                pictures = gui.add_html("")
        tab = gui.add_folder(None)
        self._panel = LessonPanel(page, tab, pictures, exercise, self._list.open)

    def _fill(self) -> None:
        add_cards(self._page, self._leave_for)
        self._page.gui.add_html(exercise_cards())

    def _leave_for(self, choice: SceneChoice) -> None:
        self._list.close()
        self._page.choose(choice)

    def follow(self, lecture: Lecture | None, settings: SceneSettings) -> None:
        if self._panel is not None:
            self._panel.follow(lecture, settings)

    def close(self) -> None:
        """Closes the list and the panel before the page removes them."""
        self._list.close()
        if self._panel is not None:
            self._panel.close()
