"""The first tab of a velocity-level scene: what to try first, the progress, and options of the 3D view."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial

from app.html.text import badge, block, esc, quantity, suggestion, swatch
from app.panels.velocity.mission import swap
from app.panels.widgets.command import on_click
from app.panels.widgets.controls import add_dark_switch
from app.tab.context import PageContext, SessionSnapshot
from lessons.events import Set
from lessons.settings.velocity import VelocitySettings
from robots.collision import Ball

_STILL = 0.02
"""Speed, m/s and rad/s, below which a joint is at rest."""
_FAR = 0.05
"""Distance between a point and its goal, m, above which the point has not reached the goal."""


class BeginPanel:
    """The controls of the first tab, and a guide that depends on what the learner has already done."""

    def __init__(
        self, page: PageContext, drives: bool, look: Callable[[], object], add_obstacle: Callable[[], object]
    ) -> None:
        """drives: whether the robot has a mobile base; look: turns the camera to the robot; add_obstacle:
        puts a ball in front of the hand."""
        gui, scene = page.gui, page.ready.choice.run.scene
        self._page, self._scene, self._drives = page, scene, drives
        places = {level.name: place for place, level in enumerate(page.settings.levels, start=1)}
        self._guide = gui.add_html(guide(scene, drives, places, dragged=False))
        self._live = gui.add_html("")
        for label, hint, does in (
            ("Swap which comes first", "The first two tasks change places", partial(swap, page)),
            ("Look at the robot", "Turns the camera to the robot's present place", look),
            (
                "Put an obstacle in the way",
                "A ball in front of the hand; drag it by its arrows",
                add_obstacle,
            ),
        ):
            on_click(gui.add_button(label, hint=hint), does)
        self._clear = gui.add_button(
            "Take the last ball away", hint="The obstacle that was added last", visible=False
        )
        on_click(self._clear, self._clear_ball)
        with gui.add_folder("Show", expand_by_default=False):
            self.trace = gui.add_checkbox("Trace of the hand and the base", True)
            self.prediction = gui.add_checkbox("Predicted paths", True)
            self.reach = gui.add_checkbox("Reach of the arm", True, visible=drives)
            self.along = gui.add_checkbox(
                "Camera follows the base", False, visible=drives, hint="You can still turn and zoom"
            )
            self.arrows = gui.add_checkbox("Arrows of obstacles", True)
            self.frames = gui.add_checkbox("Target and actual frames", True)
        add_dark_switch(page)

    def _clear_ball(self) -> None:
        ball = last_ball(self._page.settings)
        if ball is not None:
            self._page.post(Set(f"obstacles.{ball.name}", None))

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        places = {level.name: now.number(f"level/{level.name}") for level in now.settings.levels}
        self._guide.content = guide(self._scene, self._drives, places, self._page.dragged)
        lines = [self._line(now, level.name, level.tasks[0].unit) for level in now.settings.levels]
        mission = now.status.mission
        if mission is not None and mission.done:
            lines.append(badge("MISSION DONE", self._page.colours[now.settings.levels[0].name]))
        self._clear.visible = last_ball(now.settings) is not None
        self._live.content = block("<br>".join(lines))

    def _line(self, now: SessionSnapshot[VelocitySettings], role: str, unit: str) -> str:
        head = f"{swatch(self._page.colours[role])}<b>{esc(role)}</b>"
        place, error = now.number(f"level/{role}"), now.error(role)
        if place != place:
            return f"{head}: has no task now"
        text = f"{head} (level {place:.0f}): <b>{quantity(error, unit)}</b> from its present reference"
        if unit == "m" and error > _FAR and place > 1 and bool((abs(now.field("v")) < _STILL).all()):
            text += ". It rests: any further motion would disturb level 1"
        return text


def last_ball(settings: VelocitySettings) -> Ball | None:
    """Returns the newest ball among the obstacles."""
    return next((each for each in reversed(settings.htmpc.obstacles) if isinstance(each, Ball)), None)


def guide(scene: str, drives: bool, places: Mapping[str, float], dragged: bool) -> str:
    """Returns HTML that suggests what to try next.

    Args:
        scene: the name of the scene.
        drives: whether the robot has a mobile base.
        places: the present level of each role, 1 being the highest; NaN if the role has no task.
        dragged: whether a target has been dragged, so that the next suggestion is shown.
    """
    first = _FIRST.get(scene, _WATCH if drives else _FIRST_ARM)
    then = _NEXT_DRAG if scene in _FIRST else _NEXT_MISSION if drives else _NEXT_ARM
    head, rest = then if dragged else first
    levels = {
        role: f"<b>level {place:.0f}</b>" if place == place else "without a task"
        for role, place in places.items()
    }
    return suggestion(head, rest.format(**levels))


_FIRST = {
    "ridgeback-ur10-drag": (
        "Drag the two targets by their arrows.",
        "The orange ball is the target of the robot's hand: {ee}. The blue disc on the floor is the target "
        "of its base: {base}. Drag the disc so far from the ball that the arm is too short for both.",
    ),
    "ridgeback-ur10-square": (
        "Watch the base stop where the arm is stretched.",
        "The hand has to stay ({ee}). The base is sent out of reach for 8 s, and then home ({base}). Press "
        "Reset, and swap which task comes first, or set N to 1 in <b>Control</b>.",
    ),
    "ridgeback-ur10-perception": (
        "Watch the robot avoid a crate that is not there.",
        "For a while the controller gets a wrong report: the outline shows the reported place of the crate. "
        "The hand ({ee}) and the base ({base}) move along straight paths. You set the report and its time in "
        "the tab <b>Tasks</b>.",
    ),
}
_WATCH = (
    "Watch the robot begin the next task while it finishes the present task.",
    "The tab <b>Tasks</b> lists the tasks. The tasks in the window (▶ first, ▷ second) are the levels. "
    "Drag the ball or the disc: the present task of hand or base gets this goal at the next control step.",
)
_NEXT_DRAG = (
    "Now swap which task comes first.",
    "As long as the hand comes first, the base stops where the arm is stretched. After a swap, the base "
    "reaches its target and moves the hand with it. Then change δ and N in <b>Control</b>.",
)
_NEXT_MISSION = (
    "Now change the mission.",
    "In the tab <b>Tasks</b> you can change the order of the tasks, and remove or add tasks. The button "
    "<b>Release</b> ends a task that lasts until it is released.",
)
_FIRST_ARM = (
    "Drag the target by its arrows, turn it by its rings.",
    "The position of the hand is {position}, its orientation is {orientation}. Level 2 gets only the freedom "
    "that level 1 leaves.",
)
_NEXT_ARM = (
    "Now swap which task comes first.",
    "Then drag the target out of reach, or limit the speed in the tab <b>Control</b>.",
)
