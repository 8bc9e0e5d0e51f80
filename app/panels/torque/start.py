"""The first tab: what to do first, where the target is, pushes, and what the scene shows."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import viser

from app.client.wish import Send
from app.html.palette import BAD, GOOD
from app.html.text import block, esc, quantity
from app.panels.widgets.command import add_command
from app.panels.widgets.snapshot import Snapshot
from app.view.reachability import Verdict
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
    """Guidance that follows what the learner has already done."""

    def __init__(
        self, gui: viser.GuiApi, post: Send, bodies: tuple[str, ...], draggable: bool, dark: bool
    ) -> None:
        self.on_theme: Callable[[bool], None] = lambda _: None
        self.on_recall: Callable[[], None] = lambda: None
        self._dragged = False
        self._draggable = draggable
        self._guide = gui.add_html(_GUIDE if draggable else _GUIDE_FOLLOWING)
        self._where = gui.add_html("", visible=draggable)
        with gui.add_folder("Target", visible=draggable):
            self.clamp = gui.add_checkbox(
                "Keep within reach",
                True,
                hint="On: the controller gets the nearest point the robot can reach. "
                "Off: it gets your point as it is, and you see what a singular arm does.",
            )
            recall = gui.add_button("Bring the target to the hand")
        with gui.add_folder("Push the robot"):
            body = gui.add_dropdown("Body", bodies, initial_value=bodies[-1])
            force = gui.add_slider("Force [N]", min=5.0, max=100.0, step=5.0, initial_value=30.0)
            buttons = gui.add_button_group(
                "Push", tuple(_DIRECTIONS), hint=f"Along a world axis, for {PUSH_SECONDS:g} s"
            )
            self.pull = gui.add_checkbox(
                "Pull by hand",
                False,
                hint="Drag any link with the mouse: it pulls like a rubber band. Key G. While this is on, a "
                "link in front of the target keeps the mouse from it.",
            )
            self._load = gui.add_button(_PICK_UP, hint="The controller is not told")
        with gui.add_folder("Show", expand_by_default=False):
            self.trace = gui.add_checkbox("Trace of the hand", True)
            self.prediction = gui.add_checkbox("Predicted path", True)
            self.frames = gui.add_checkbox("Target and actual frames", True)
            self.ellipsoids = gui.add_checkbox(
                "Manipulability ellipsoids",
                False,
                hint="How fast each level could move its frame with joints of unit speed, by what the levels "
                "above leave it; flat where it cannot",
            )
        self.dark = gui.add_checkbox("Dark theme", dark)

        @buttons.on_click
        async def _(_: object) -> None:
            direction = np.array(_DIRECTIONS[str(buttons.value)], float)
            vector = tuple(float(x) for x in force.value * direction)
            post(Push(str(body.value), vector, (0.0, 0.0, 0.0), PUSH_SECONDS))

        add_command(gui, "Pull at links by hand, or not", "G", self._grab)

        @self._load.on_click
        async def _(_: object) -> None:
            post(Set("plant.payload_kg", _LOAD if self._load.label == _PICK_UP else 0.0))

        @recall.on_click
        async def _(_: object) -> None:
            self.on_recall()

        @self.dark.on_update
        async def _(event: viser.GuiEvent[viser.GuiCheckboxHandle]) -> None:
            if event.client is not None:
                self.on_theme(bool(self.dark.value))

    def _grab(self) -> None:
        self.pull.value = not self.pull.value

    def dragged(self) -> None:
        """The first drag happened: go on to what comes next."""
        if not self._dragged:
            self._dragged = True
            self._guide.content = _GUIDE_NEXT

    def show_verdict(self, verdict: Verdict | None, clamped: bool) -> None:
        """Where the target is, in words."""
        if verdict is None:
            self._where.content = block("The target is where the hand is.")
            return
        colour = "rgb({},{},{})".format(*(GOOD if verdict.reachable else BAD))
        if verdict.reachable:
            text = "Target within reach."
        else:
            text = f"Out of reach by {quantity(verdict.missing, 'm')}. " + (
                "The controller gets the nearest point instead (the ball without arrows)."
                if clamped
                else "The controller gets it all the same."
            )
        if verdict.turned_away > 0:
            text += " This orientation cannot be met there: the lower level gives way."
        self._where.content = block(f'<b style="color:{colour}">●</b> {esc(text)}')

    def update(self, now: Snapshot[TorqueSettings]) -> None:
        """The button offers what is not the case."""
        label = _DROP if now.settings.plant.payload_kg > 0 else _PICK_UP
        if self._load.label != label:
            self._load.label = label


_GUIDE = block(
    '<div style="font-size:1.15em"><b>Drag the target by its arrows.</b></div>'
    "It is the orange ball at the robot's hand, and the hand follows it: that is <b>level 1</b>. "
    "Orientation (level 2) and posture (level 3) get only the freedom that is left.",
    "padding-top:0.5em",
)
_GUIDE_FOLLOWING = block(
    '<div style="font-size:1.15em"><b>Watch the hand follow the curve.</b></div>'
    "Then switch a level off in the tab <b>Tasks</b>, or push the robot below, and see which errors grow.",
    "padding-top:0.5em",
)
_GUIDE_NEXT = block(
    '<div style="font-size:1.15em"><b>Now switch a level off.</b></div>'
    "Open <b>Tasks</b> (or press 2): its error grows while level 1 stays where it is. Then drag the target "
    "out of reach, push the robot below, or put 5 kg on its hand in <b>Plant</b>.",
    "padding-top:0.5em",
)
