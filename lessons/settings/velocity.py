"""All settings of a velocity-level scene, and their paths."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from typing import Annotated, Any, ClassVar

from himpc.catalog import VELOCITY_CONTROLLERS
from himpc.htmpc import HTMPCSettings
from himpc.stack import Stack
from lessons.events import Appear, Event
from lessons.settings.missions import MissionOptions, Stay
from lessons.settings.schema import Setting, Shape, setting_of_all_levels, settings_of_levels, written
from lessons.settings.settings import SceneSettings
from lessons.settings.stack import ordered
from lessons.settings.values import NUMBER, Form
from robots import InputError, VelocityPlantSettings
from robots.collision import Ball, Box, Floor, Obstacle
from robots.errors import unknown_name
from robots.ranges import Folder, Shown

STAGE_WEIGHT: dict[str, float] = {"proximal": 10.0, "paper": 1.0}
"""Q of (8) with which each formulation was tuned; the choice of a formulation sets this Q."""

_RATE_HZ = {"htidkc": 50.0, "placo": 50.0}
"""Control rates of the controllers whose rate is not 10 Hz. The choice of a controller sets the rate."""


@dataclass(frozen=True)
class VelocitySettings(SceneSettings):
    """Settings of a velocity-level run.

    Attributes:
        htmpc: the controller's settings. Their stack has one level per role; the mission's window orders the
            levels.
        controller: one of VELOCITY_CONTROLLERS.
        delay_measured: whether the commands of a plan are delayed by the plan's measured computing time in
            addition to `plant.delay_ms`, as on a real robot, which does not wait; then no two runs are the
            same.
        options: the scene's own choices.
    """

    page_order: ClassVar[tuple[str, ...]] = (
        "controller", "", "Q", "levels", "plant", "order", "architecture", "base_tolerance", "base_at_rest"
    )  # fmt: skip

    htmpc: Annotated[HTMPCSettings, Folder("")]
    # fmt: off
    controller: Annotated[str, Shown(
        "Controller", "You can switch the controller while the robot moves")] = "htmpc"
    compensate_delay: Annotated[bool, Shown(
        "Compensate delay", "Predict the measured state forward by the plant's lag before planning",
        tries=("false", "true"), name="delay compensated", group="Delay")] = True
    delay_measured: Annotated[bool, Shown(
        "Delay as measured", "Delay each command by its computing time, as on a real robot, which does not "
        "wait", group="Delay")] = False
    # fmt: on
    plant: VelocityPlantSettings = field(default_factory=VelocityPlantSettings)
    options: MissionOptions = field(default_factory=Stay)

    @property
    def controllers(self) -> Mapping[str, str]:
        return VELOCITY_CONTROLLERS

    def __post_init__(self) -> None:
        """Raises InputError for a controller that does not exist."""
        if self.controller not in VELOCITY_CONTROLLERS:
            raise unknown_name("velocity-level controller", self.controller, VELOCITY_CONTROLLERS)

    def with_delay(self, solve_ms: float) -> VelocityPlantSettings:
        """Returns the plant on which the commands of a plan act if the computation of the plan took this many
        ms."""
        if not self.delay_measured:
            return self.plant
        return replace(self.plant, delay_ms=min(self.plant.delay_ms + solve_ms, LONGEST_DELAY))

    @property
    def levels(self) -> Stack:  # pyright: ignore[reportIncompatibleVariableOverride]
        """One level per role."""
        return self.htmpc.stack

    @property
    def horizon(self) -> int:  # pyright: ignore[reportIncompatibleVariableOverride]
        """N, knots."""
        return self.htmpc.horizon

    @property
    def T_s(self) -> float:  # pyright: ignore[reportIncompatibleVariableOverride]
        """Control period, s."""
        return self.htmpc.period

    @property
    def lexicographic_delta(self) -> float | None:
        """δ of (12), m (or rad); None if another constraint restricts the lower levels."""
        by_error = self.controller in ("htmpc", "htmpc_wpt") and self.htmpc.lexicographic == "per_coordinate"
        return self.htmpc.delta_m if by_error else None

    @property
    def measures_time(self) -> bool:
        return self.delay_measured

    def takes(self, event: Event) -> bool:
        return isinstance(event, Appear) or super().takes(event)

    def after(self, event: Event) -> VelocitySettings:
        return self.with_obstacle(event.ball()) if isinstance(event, Appear) else super().after(event)

    @classmethod
    def special(cls, table: Mapping[str, Setting], shape: Shape) -> Iterable[Setting]:
        """Besides the fields, also those of HTMPCSettings ("horizon", "delta_m", "formulation", …) and of the
        scene's options ("peak", "seats", …; "order" takes effect when a run starts), there are "Q" for all
        levels (a new formulation sets its own) and "levels.NAME.Q|enabled" with the level's name or its place
        1 … r."""
        formulation, controller = table["formulation"], table["controller"]
        yield replace(controller, change=lambda s, value: _at_its_rate(controller.change(s, value)))
        yield replace(formulation, change=lambda s, value: _with_its_weight(formulation.change(s, value)))
        if "order" in table:
            order = table["order"]
            yield replace(order, change=lambda s, value: order.change(s, _roles(s, value)))
        yield setting_of_all_levels("Q", _STACK, _OF_LEVELS["Q"])
        yield from settings_of_levels(shape, _STACK, ("enabled", "Q"), (), _OF_LEVELS)

    def elements(self, path: str) -> int:
        if path == "report_offset":
            return 3
        return max(len(self.htmpc.gains), len(self.levels)) if path == "gains" else 0

    def setting(self, path: str) -> Setting:
        """As in `SceneSettings`, and also "obstacles.NAME": [x, y, z, radius] adds a ball or replaces the
        obstacle of that name, [x, y, z] moves it, and None removes it."""
        head, _, name = path.partition(".")
        if head != "obstacles" or not name:
            return super().setting(path)
        return Setting(
            path,
            Shown(name.rpartition(".")[2], name=path),
            _BALL,
            lambda settings: _seen(settings, name),
            lambda settings, value: _with_obstacle(settings, name, value),
            path,
        )

    def special_differences(self, wanted: VelocitySettings) -> list[tuple[str, Any]]:
        """Obstacles that were removed, added or moved; added and moved ones come last, in the order of these
        changes."""
        left = {obstacle.name for obstacle in wanted.htmpc.obstacles}
        own = self.htmpc.obstacles
        changes = [(f"obstacles.{obstacle.name}", None) for obstacle in own if obstacle.name not in left]
        rest = tuple(obstacle for obstacle in own if obstacle.name in left)
        for count in range(len(wanted.htmpc.obstacles) + 1):
            at = len(wanted.htmpc.obstacles) - count
            kept, last = wanted.htmpc.obstacles[:at], wanted.htmpc.obstacles[at:]
            moved = {obstacle.name for obstacle in last}
            if tuple(obstacle for obstacle in rest if obstacle.name not in moved) == kept:
                return changes + [
                    _as_setting(obstacle) for obstacle in last if not isinstance(obstacle, Floor)
                ]
        return changes

    def with_obstacle(self, obstacle: Obstacle) -> VelocitySettings:
        """Returns the settings with an obstacle added, or with the obstacle of this name replaced."""
        obstacles = (*_without(self.htmpc.obstacles, obstacle.name), obstacle)
        return written(self, _OBSTACLES, obstacles)


LONGEST_DELAY = 1e3
"""Largest delay of a command, ms."""


def _at_its_rate(settings: VelocitySettings) -> VelocitySettings:
    return written(settings, ("htmpc", "rate_hz"), _RATE_HZ.get(settings.controller, 10.0))


def _with_its_weight(settings: VelocitySettings) -> VelocitySettings:
    return written(settings, (*_STACK, None, "Q"), STAGE_WEIGHT[settings.htmpc.formulation])


def _roles(settings: VelocitySettings, names: Any) -> tuple[str, ...]:
    return tuple(level.name for level in ordered(settings.levels, names))


_STACK = ("htmpc", "stack")
_OBSTACLES = ("htmpc", "obstacles")
_BALL = Form(None, NUMBER, null=True)
_OF_LEVELS = {
    "Q": Shown(
        "Q", "Weight of the errors relative to the effort; sets all levels at once", "", 0.1, 100.0, 0.1,
    ),
    "levels.*.Q": Shown(
        "Q", "Weight of this level's errors relative to its effort", "", 0.1, 100.0, 0.1,
        tries=("20", "100", "200", "500", "2000"), name="Q of *",
    ),
}  # fmt: skip


def _movable(settings: VelocitySettings) -> dict[str, Ball | Box]:
    obstacles = settings.htmpc.obstacles
    return {obstacle.name: obstacle for obstacle in obstacles if not isinstance(obstacle, Floor)}


def _seen(settings: VelocitySettings, name: str) -> Any:
    obstacle = _movable(settings).get(name)
    return None if obstacle is None else _as_setting(obstacle)[1]


def _with_obstacle(settings: VelocitySettings, name: str, value: Any) -> VelocitySettings:
    known = _movable(settings)
    if value is not None:
        return settings.with_obstacle(_obstacle(known, f"obstacles.{name}", name, value))
    if name not in known:
        raise unknown_name("obstacle", name, known)
    return written(settings, _OBSTACLES, _without(settings.htmpc.obstacles, name))


def _as_setting(obstacle: Ball | Box) -> tuple[str, Any]:
    where = (*obstacle.centre, obstacle.radius) if isinstance(obstacle, Ball) else obstacle.centre
    return f"obstacles.{obstacle.name}", where


def _without(obstacles: tuple[Obstacle, ...], name: str) -> tuple[Obstacle, ...]:
    return tuple(obstacle for obstacle in obstacles if obstacle.name != name)


def _obstacle(known: Mapping[str, Ball | Box], path: str, name: str, value: Any) -> Obstacle:
    numbers = value if not isinstance(value, (list, tuple)) else _BALL.fit(path, value)
    if isinstance(numbers, tuple) and len(numbers) == 4:
        x, y, z, radius = numbers
        return Ball(name, (x, y, z), radius)
    if isinstance(numbers, tuple) and len(numbers) == 3 and name in known:
        x, y, z = numbers
        return replace(known[name], centre=(x, y, z))
    movable = f", or move {', '.join(known)} to [x, y, z], or remove one by null" if known else ""
    raise InputError(
        f"{path} is {value!r}: give a ball as [x, y, z, radius] in m, e.g. [2, 0, 1, 0.3]{movable}"
    )
