"""One browser tab: builds the view and the panels for a learner's session and keeps them up to date. A lesson
of the user's own is shown again when its file is saved."""

from __future__ import annotations

import contextlib
import math
import threading
import time
import traceback
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, final

import numpy as np
import viser

from app.adapter import private
from app.client.simulation import Trouble
from app.client.simulation_client import SimulationClient
from app.html.palette import level_colours
from app.html.text import block, esc, in_trouble
from app.link.choice import SceneChoice
from app.link.messages import Ready
from app.link.threads import on_thread
from app.panels.widgets.command import add_command
from app.tab.visitor import Visitor
from lessons.course import COURSE, heading
from lessons.own.files import Stamp, is_lesson, stamp
from robots import InputError

if TYPE_CHECKING:
    from app.page.scene_view import SceneView
    from app.view.robot import RecordedRun


class LessonFile:
    """Looks at the file whenever the page asks.

    Attributes:
        fault: what is wrong with the saved version, in one sentence; None if nothing is. The page continues
            to show the version before.
    """

    def __init__(self) -> None:
        self.fault: str | None = None
        self._stamp: Stamp | None = None

    def saved(self, choice: SceneChoice) -> SceneChoice | None:
        """Returns the choice with the saved version of its lesson, if there is one that can be used."""
        place = choice.exercise
        if place is None or not is_lesson(place.lesson):
            self.fault = None
            return None
        found = stamp(place.lesson)
        if found is None:
            return None
        before, self._stamp = self._stamp, found
        if before is None or before == found or before[0] != found[0]:
            return None
        try:
            new = choice.at(replace(place, text=None).opened)
        except InputError as error:
            self.fault = choice.without_places(f"{error}. The page shows the version before.")
            return None
        self.fault = None
        return None if new.exercise == place else new


NARROW = 1000  # px: a narrower window, as in the cell of a notebook, has no room for panels at both sides
_BROKEN = (
    "This page cannot be shown: {}. Press Start again to load the scene again. If this does not help, reload "
    "the page and choose another scene."
)

_RECORDED = (
    "The robot plays a recorded run of this lesson. You can move it yourself as soon as the controllers are "
    "compiled."
)
_NOT_ITS_FILE = "This page may not open files of the machine that himpc-lab runs on."
POSES, PLOTS, TEXTS = 30.0, 12.0, 3.75  # Hz, while simulated time is as fast as real time
CALM = 6.0  # Hz, the rate of poses, plots and texts when the robot has stood still for STILL
STILL = 1.0  # s
LEAST = 1 / 3
"""The smallest factor by which POSES and PLOTS are multiplied while simulated time is slowed down."""


def lay_out(gui: viser.GuiApi) -> None:
    gui.set_panel_label("himpc-lab")
    gui.main_panel.dock_right()
    gui.main_panel.set_width(400)


def starting(choice: SceneChoice) -> str:
    return block("<b>Starting the robot …</b>") + first_lesson(choice)


def opens_first(choice: SceneChoice) -> bool:
    """Returns whether the first lesson is named on a page that waits for its robot."""
    return choice.exercise is None or choice.exercise.lesson == COURSE[0]


def first_lesson(choice: SceneChoice) -> str:
    """Returns the title and the question of the lesson that will be shown, or of the first lesson; "" for a
    user's own lesson."""
    name = COURSE[0] if choice.exercise is None else choice.exercise.lesson
    if name not in COURSE:
        return ""
    title, question = heading(name)
    title = f"Lesson {COURSE.index(name) + 1} · {title}"
    return block(f"<b>{esc(title)}</b><br>{esc(question)}")


class Page:
    """A thread that shows a learner's session, and builds a `SceneView` for every scene."""

    def __init__(
        self,
        visitor: Visitor,
        learner: SimulationClient,
        greet: Callable[[viser.GuiApi], None],
    ) -> None:
        """greet: adds elements at the top of the panel whenever the panel is built."""
        self.learner = learner
        self._greet = greet
        self._visitor, self._client = visitor, visitor.client
        self._fault = FaultNotice(visitor.client)
        self._lesson_file = LessonFile()
        self._phone = self._narrow = False
        self._seen: tuple[object, ...] | None = None  # the scene for which the camera was turned
        self._scene: SceneView | None = None
        self._built: Ready | None = None
        self._trouble: Trouble | None = None
        self._cadence = Cadence()
        self._saves = 0
        self._waiting: viser.GuiHtmlHandle | None = None
        self._recorded: RecordedRun | None = None
        self._again: viser.GuiButtonHandle | None = None
        self._closed = threading.Event()
        self._thread: threading.Thread | None = None

    def start(self) -> None:
        camera, comfort = self._client.camera, self._visitor.comfort
        wide, high = comfort.window or (camera.image_width, camera.image_height)
        self._phone, self._narrow = wide < high, wide < max(high, NARROW)
        gui = self._client.gui
        lay_out(gui)
        comfort.set_theme(comfort.dark)
        self._waiting = gui.add_html(starting(self.learner.choice))
        self._thread = on_thread("page's loop", self._loop_on_thread)

    def close(self) -> None:
        self._closed.set()
        if self._thread is not None and self._thread is not threading.current_thread():
            self._thread.join(2.0)
        if self._scene is not None:
            self._scene.close()

    # ---------------------------------------------------------------- loop

    def _loop_on_thread(self) -> None:
        while not self._closed.is_set():
            began = time.perf_counter()
            try:
                self._look(began)
            except Exception as error:
                self._break(error)
            status, scene = self.learner.status, self._scene
            pace = 1.0 if status is None or not status.capped else status.real_time_factor
            period = self._cadence.shown(None if scene is None else scene.shown, pace, began)
            self._closed.wait(max(0.002, period - (time.perf_counter() - began)))

    def _look(self, now: float) -> None:
        learner = self.learner
        ready = learner.ready
        if ready is not None and ready is not self._built and self._delivered():
            before, self._built = self._built, ready  # a scene that cannot be built is tried only once
            same = ready.again and before is not None and before.choice == ready.choice
            try:
                self._show(ready, same)
            except Exception:
                if learner.ready is ready:
                    raise
                self._drop_scene()  # another scene was loaded meanwhile; it is built in the next cycle
                return
        self._pass_on()
        self._show_saved_lesson()
        scene = self._scene
        if scene is None:
            self._show_early_trouble()
            self._play_recorded(now)
            return
        trouble = learner.trouble() or self._own_trouble()
        if trouble != self._trouble:
            self._trouble = trouble
            scene.show_trouble(trouble)
        if private.waiting(self._client) > 0:
            learner.look()  # the connection is slow: data are stored, and the next picture shows newer data
            return
        try:
            scene.follow(plots=self._cadence.plots_due(now), texts=self._cadence.texts_due(now))
        except Exception:
            # Another scene may be loaded at any moment; its rows and poses do not fit this scene.
            if learner.ready is self._built:
                raise

    def _delivered(self) -> bool:
        """Returns whether the browser has received the scene that was built last. The next scene is built
        only after that. Otherwise, on a slow connection, the messages of all scenes that a learner opens
        would accumulate."""
        return self._scene is None or private.waiting(self._client) == 0

    def _show(self, ready: Ready, same: bool) -> None:
        """Builds a scene. same: whether the scene continues the run that is shown, with another stack."""
        if same and self._scene is not None:
            with self._client.atomic():
                self._scene.recompose(ready)
        else:
            self._build(ready)

    def _show_saved_lesson(self) -> None:
        """Opens the step of the user's own lesson again when its file was saved."""
        saved = self._lesson_file.saved(self.learner.choice)
        if saved is not None:
            self.learner.load(saved)
            self._client.add_notification("Saved lesson is shown", "", color="green", auto_close_seconds=4.0)

    def _own_trouble(self) -> Trouble | None:
        """Returns the fault of the learner's own code, if there is one. Also shows a notice when saved code
        takes effect."""
        status = self.learner.status
        own = None if status is None else status.own
        fault = None if own is None or own.fault is None else self.learner.choice.without_places(own.fault)
        self._fault.show(fault or self._lesson_file.fault)
        if own is None:
            wrong = self._lesson_file.fault
            return None if wrong is None else Trouble("YOUR LESSON", wrong, None)
        if own.saves > self._saves:
            self._client.add_notification(
                "Saved code is running",
                f"{Path(own.file).name} took over at t = {own.at:.2f} s. The file is read from the disk of "
                "the machine that runs the lab.",
                color="green",
                auto_close_seconds=4.0,
            )
        self._saves = own.saves
        return None if fault is None else Trouble("YOUR CODE", fault, None)

    def _show_early_trouble(self) -> None:
        """Shows that the simulation ended or hangs before it sent its first report."""
        trouble = self.learner.trouble()
        if trouble == self._trouble or self._waiting is None:
            return
        self._trouble = trouble
        self._waiting.content = (
            starting(self.learner.choice)
            if trouble is None
            else in_trouble(trouble.state, trouble.sentence) + first_lesson(self.learner.choice)
        )
        if self._recorded is not None:
            self._waiting.content += block(_RECORDED)
        if self._again is None:
            self._again = self._client.gui.add_button("Start again")
            self._again.on_click(lambda _: self.learner.restart())
        self._again.visible = trouble is not None and trouble.offer is not None

    def _play_recorded(self, now: float) -> None:
        """While the controllers are compiled, the robot of the first lesson plays a recorded run."""
        if self._recorded is not None:
            self._recorded.follow(now)
        elif self._waiting is not None and self.learner.compiles and opens_first(self.learner.choice):
            from app.view.robot import RecordedRun

            self._recorded = RecordedRun(self._client, self._phone, now)

    def _load(self, choice: SceneChoice) -> None:
        """Loads the scene that a panel requests. Refuses files that this page may not name."""
        asked = choice.asked - self.learner.choice.paths
        own_files = self._visitor.own_files
        if asked and (own_files is None or not all(map(own_files.holds, asked))):
            self._client.add_notification("Not loaded", _NOT_ITS_FILE, color="red")
            return
        self.learner.load(choice)

    def _build(self, ready: Ready) -> None:
        # Imported here, so that the page can open and show a waiting message before these modules are loaded.
        from app.page.scene_view import SceneView
        from app.tab.context import PageContext
        from app.view.robot import aim
        from app.view.targets import in_order

        self._drop_scene()
        self._recorded = None
        with self._client.atomic():
            self._client.scene.reset()
            self._client.gui.reset()
            self._greet(self._client.gui)
            colours = level_colours([task.level for task in in_order(ready)])
            context = PageContext(self._visitor, self.learner, ready, colours, self._load)
            self._scene = SceneView(context, self._narrow)
            add_command(self._client.gui, "Camera: show the whole robot", "F", self._frame)
            self._visitor.comfort.opened(self.learner)
            run = ready.choice.run
            seen = (run.scene, run.urdf, run.tip, run.hold, ready.choice.urdf_text, ready.robot.name)
            if seen != self._seen:  # after a restart the camera stays as the learner left it
                ways = [task.path for task in ready.tasks if task.path is not None]
                covered = self._scene.covered
                aim(self._client.camera, ready.robot, self._phone, ready.room, ways, covered)
                self._seen = seen
        for sentence in ready.left_out:
            self._client.add_notification("Opened without one of your tasks", sentence, color="orange")
        self._trouble = None

    def _drop_scene(self) -> None:
        before, self._scene = self._scene, None
        if before is not None:
            before.close()

    def _frame(self) -> None:
        """Moves the camera so that the robot is in the middle of the picture, seen from the present
        direction."""
        from app.view.camera import look

        poses, ready = self.learner.read(lambda recording: recording.block.poses()), self._built
        if poses is None or ready is None or not np.isfinite(poses).all():
            return
        base = np.zeros((0 if len(ready.room) else 1, 3))  # a mobile robot may be far from the origin
        covered = (0.0, 0.0) if self._scene is None else self._scene.covered
        look(self._client.camera, np.vstack([base, poses[:, :3]]), self._phone, None, covered)

    def _break(self, error: Exception) -> None:
        """Shows an error of the page with a sentence and a button to continue, in place of the broken
        view."""
        if self._closed.is_set():
            return  # the tab was closed, and its panels no longer exist
        traceback.print_exc()
        before, self._scene = self._scene, None
        self._waiting = self._again = self._recorded = None
        with contextlib.suppress(Exception), self._client.atomic():
            self._client.scene.reset()
            self._client.gui.reset()
            self._client.gui.add_html(in_trouble("STOPPED", _BROKEN.format(_words(error))))
            self._client.gui.add_button("Start again").on_click(lambda _: self.learner.restart())
        if before is not None:
            with contextlib.suppress(Exception):
                before.close()

    def _pass_on(self) -> None:
        """Shows the session's notices, and its refusals, each in the panel that made the request."""
        refusals, notices = self.learner.take_messages()
        for sentence in map(self.learner.choice.without_places, refusals):
            if self._scene is None or not self._scene.refuse(sentence):
                self._client.add_notification("Not loaded", sentence, color="red")
        for sentence in map(self.learner.choice.without_places, notices[-3:]):
            self._client.add_notification("Not changed", sentence, color="orange", auto_close_seconds=8.0)


def _words(error: Exception) -> str:
    return f"{type(error).__name__}: {error}"[:300]


class FaultNotice:
    """A notification at the top of the page. It stays until the code is corrected or the learner closes the
    notification."""

    def __init__(self, client: viser.ClientHandle) -> None:
        self._client = client
        self._said: str | None = None
        self._shown: viser.NotificationHandle | None = None

    def show(self, sentence: str | None) -> None:
        """Shows the sentence of a fault; None removes the notification."""
        if sentence == self._said:
            return
        self._said = sentence
        # The notification is replaced, not updated. A closed notification would stay closed, and the new
        # fault would not be shown.
        if self._shown is not None:
            self._shown.remove()
        self._shown = None
        if sentence is not None:
            self._shown = self._client.add_notification("Your file", sentence, color="red")


@final
class Cadence:
    """The rates of one page. Times are arguments, so that tests need no clock."""

    def __init__(self) -> None:
        self._shown: object = None
        self._moved = -math.inf
        self._share = 1.0
        self._next_plots = self._next_texts = 0.0

    def shown(self, instant: object, pace: float, now: float) -> float:
        """Returns the time until the page should check for changes again, s.

        Args:
            instant: identifies the instant that is shown; None while no instant is shown.
            pace: simulated seconds per real second if simulated time is slowed down, otherwise 1.
            now: the present time, s.
        """
        if instant is None or instant != self._shown:
            self._shown, self._moved = instant, now
        self._share = min(1.0, max(LEAST, pace))
        return 1 / CALM if self._calm(now) else 1 / (self._share * POSES)

    def plots_due(self, now: float) -> bool:
        if self._calm(now):
            return True
        if now < self._next_plots:
            return False
        # The page checks slightly too early or too late; this limit keeps the average rate.
        late = now - 1 / (self._share * POSES)
        self._next_plots = max(self._next_plots, late) + 1 / (self._share * PLOTS)
        return True

    def texts_due(self, now: float) -> bool:
        """Returns whether the texts should be written now. Slowed simulated time does not reduce their
        rate."""
        if now < self._next_texts and not self._calm(now):
            return False
        self._next_texts = now + 1 / TEXTS
        return True

    def _calm(self, now: float) -> bool:
        return now - self._moved > STILL
