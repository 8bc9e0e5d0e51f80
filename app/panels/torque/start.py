"""The first tab: what to try first, the state of the target, pushes, and options of the 3D view."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np
import viser

from app.client.pending_edit import Send
from app.html.palette import BAD, GOOD, RGB, ink
from app.html.text import block, esc, quantity
from app.link.messages import Ready
from app.panels.torque.guide import AT_AN_ARM, guide
from app.panels.widgets.command import add_command, on_click
from app.panels.widgets.snapshot import SessionSnapshot
from app.view.reachability import Reachability
from lessons.events import Push, Set
from lessons.settings.torque import TorqueSettings

_DIRECTIONS = {
    "→ +x": (1, 0, 0),
    "← −x": (-1, 0, 0),
    "+y": (0, 1, 0),
    "−y": (0, -1, 0),
    "↑ +z": (0, 0, 1),
    "↓ −z": (0, 0, -1),
}
PUSH_SECONDS = 0.1
_LOAD = 3.0  # kg
_PICK_UP, _DROP = f"Pick up {_LOAD:g} kg", "Drop the payload"


class StartPanel:
    """The controls of the first tab, and a guide that depends on what the learner has already done."""

    def __init__(
        self,
        gui: viser.GuiApi,
        post: Send,
        ready: Ready,
        settings: TorqueSettings,
        colours: Mapping[str, RGB],
        dark: bool,
    ) -> None:
        """settings: the present settings; colours: the colour of each level."""
        self.on_theme: Callable[[bool], None] = lambda _: None
        self.on_recall: Callable[[], None] = lambda: None
        self._dragged = False
        told = AT_AN_ARM if ready.arm else guide(ready.tasks, settings.levels, colours, dragged=False)
        self._guide = gui.add_html(told)
        draggable = any(task.kind == "position" and task.raw is not None for task in ready.tasks)
        self._where = gui.add_html("", visible=draggable)
        with gui.add_folder("Target", visible=draggable):
            self.clamp = gui.add_checkbox(
                "Keep within reach",
                True,
                hint="On: the controller gets the nearest point that the robot can reach. "
                "Off: the controller gets your point unchanged, and you see how a singular arm moves.",
            )
            recall = gui.add_button("Bring the target to the hand")
        with gui.add_folder("Push the robot", visible=not ready.arm):
            bodies = ready.robot.joint_names
            body = gui.add_dropdown("Body", bodies, initial_value=bodies[-1])
            force = gui.add_slider("Force [N]", min=5.0, max=100.0, step=5.0, initial_value=30.0)
            buttons = gui.add_button_group(
                "Push", tuple(_DIRECTIONS), hint=f"Along a world axis, for {PUSH_SECONDS:g} s"
            )
            self.pull = gui.add_checkbox(
                "Pull by hand",
                False,
                hint="Drag any link with the mouse: the force grows with the distance, as with a rubber "
                "band. Key G. While this is on, you cannot drag the target through a link in front of it.",
            )
            self._load = gui.add_button(_PICK_UP, hint="The controller does not know about the payload")
        with gui.add_folder("Show", expand_by_default=False):
            self.trace = gui.add_checkbox("Trace of the hand", True)
            self.prediction = gui.add_checkbox("Predicted path", True)
            self.frames = gui.add_checkbox("Target and actual frames", True)
            self.ellipsoids = gui.add_checkbox(
                "Manipulability ellipsoids",
                False,
                hint="The speed at which each level can move its frame if the joints have unit speed. "
                "A level uses only the freedom that the levels above leave. The ellipsoid is flat in "
                "directions without motion",
            )
            self.cover = gui.add_checkbox(
                "Capsules for distances",
                False,
                hint="The capsules that contain the links. A controller that keeps distances measures them "
                "between these capsules, which are a few millimetres thicker than the links",
            )
        self.dark = gui.add_checkbox("Dark theme", dark)

        @buttons.on_click
        async def _(_: object) -> None:
            direction = np.array(_DIRECTIONS[str(buttons.value)], float)
            vector = tuple(float(x) for x in force.value * direction)
            post(Push(str(body.value), vector, (0.0, 0.0, 0.0), PUSH_SECONDS))

        add_command(gui, "Turn pulling links by hand on or off", "G", self._grab)

        @self._load.on_click
        async def _(_: object) -> None:
            post(Set("plant.payload_kg", _LOAD if self._load.label == _PICK_UP else 0.0))

        on_click(recall, lambda: self.on_recall())

        @self.dark.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client is not None:
                self.on_theme(bool(self.dark.value))

    def _grab(self) -> None:
        self.pull.value = not self.pull.value

    def dragged(self) -> None:
        """Called when a target is dragged: the guide then shows the next step."""
        self._dragged = True

    def show_verdict(self, verdict: Reachability | None, clamped: bool) -> None:
        """Shows a sentence about the state of the target."""
        if verdict is None:
            self._where.content = block("The target is where the hand is.")
            return
        colour = ink(GOOD if verdict.reachable else BAD)
        if verdict.reachable:
            text = "Target within reach."
        else:
            text = f"Out of reach by {quantity(verdict.missing, 'm')}. " + (
                "The controller gets the nearest point instead (the ball without arrows)."
                if clamped
                else "The controller gets your point unchanged."
            )
        if verdict.turned_away > 0:
            text += " The robot cannot have this orientation there: the lower level keeps an error."
        self._where.content = block(f'<b style="color:{colour}">●</b> {esc(text)}')

    def update(self, now: SessionSnapshot[TorqueSettings], colours: Mapping[str, RGB]) -> None:
        """Updates the names of the levels in the guide, and the label of the button."""
        tasks, levels = now.ready.tasks, now.settings.levels
        told = AT_AN_ARM if now.ready.arm else guide(tasks, levels, colours, self._dragged)
        if self._guide.content != told:
            self._guide.content = told
        label = _DROP if now.settings.plant.payload_kg > 0 else _PICK_UP
        if self._load.label != label:
            self._load.label = label
