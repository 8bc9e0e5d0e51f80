"""All settings of a velocity-level scene, and their paths."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Any, ClassVar

from himpc.catalog import VELOCITY_CONTROLLERS
from himpc.htmpc import HTMPCSettings, MotionLimits
from himpc.stack import Stack
from lessons.events import Appear, Event
from lessons.settings.entry import Entry
from lessons.settings.levels import ordered
from lessons.settings.missions import MissionOptions, Stay
from lessons.settings.settings import Place, SceneSettings, every_level, field_places, level_key, level_places
from lessons.settings.values import NUMBER, WORD, Form
from lessons.settings.velocity_entries import VELOCITY_ENTRIES
from robots import InputError, VelocityPlantSettings
from robots.collision import Ball, Box, Floor, Obstacle
from robots.errors import unknown_name

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
        compensate_delay: whether the measured state is predicted forward by the plant's lag before planning.
        delay_measured: whether the commands of a plan are delayed by the plan's measured computing time in
            addition to `plant.delay_ms`, as on a real robot, which does not wait; then no two runs are the
            same.
        plant: the parameters of the simulated plant.
        options: the scene's own choices.
    """

    entries: ClassVar[tuple[Entry, ...]] = VELOCITY_ENTRIES

    htmpc: HTMPCSettings
    controller: str = "htmpc"
    compensate_delay: bool = True
    delay_measured: bool = False
    plant: VelocityPlantSettings = field(default_factory=VelocityPlantSettings)
    options: MissionOptions = field(default_factory=Stay)

    @property
    def controllers(self) -> Mapping[str, str]:
        return VELOCITY_CONTROLLERS

    def __post_init__(self) -> None:
        """Raises InputError for a controller that does not exist."""
        if self.controller not in VELOCITY_CONTROLLERS:
            raise unknown_name("velocity-level controller", self.controller, VELOCITY_CONTROLLERS)

    def felt(self, solve_ms: float) -> VelocityPlantSettings:
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

    def places(self) -> Mapping[str, Place]:
        """Returns the place of every path. The paths are those of HTMPCSettings ("horizon", "delta_m",
        "formulation", …), "controller", "compensate_delay", "delay_measured", those of the scene's options
        ("peak", "seats", …; "order" takes effect when a run starts), "limits.KEY", "plant.KEY", "Q" for all
        levels (a new formulation sets its own), "levels.NAME.Q|enabled" with the level's name or its place
        1 … r."""
        return _places(tuple(level.name for level in self.levels), type(self.options))

    def elements(self, path: str) -> int:
        if path == "report_offset":
            return 3
        return max(len(self.htmpc.gains), len(self.levels)) if path == "gains" else 0

    def place(self, path: str) -> Place:
        """As in `SceneSettings`, and also "obstacles.NAME": [x, y, z, radius] adds a ball or replaces the
        obstacle of that name, [x, y, z] moves it, and None removes it."""
        head, _, name = path.partition(".")
        if head != "obstacles" or not name:
            return super().place(path)

        def fit(settings: VelocitySettings, path: str, value: Any) -> Obstacle | None:
            known = {each.name: each for each in settings.htmpc.obstacles if not isinstance(each, Floor)}
            if value is None and name not in known:
                raise unknown_name("obstacle", name, known)
            return None if value is None else _obstacle(known, path, name, value)

        return Place(lambda settings: _seen(settings, name), _put(name), _BALL, fit)

    def special_differences(self, wanted: VelocitySettings) -> list[tuple[str, Any]]:
        """Obstacles that were removed, added or moved; added and moved ones come last, in the order of these
        changes."""
        left = {each.name for each in wanted.htmpc.obstacles}
        told = [(f"obstacles.{each.name}", None) for each in self.htmpc.obstacles if each.name not in left]
        rest = tuple(each for each in self.htmpc.obstacles if each.name in left)
        for count in range(len(wanted.htmpc.obstacles) + 1):
            kept, last = _split(wanted.htmpc.obstacles, count)
            if tuple(each for each in rest if each.name not in {moved.name for moved in last}) == kept:
                return told + [_as_setting(each) for each in last if not isinstance(each, Floor)]
        return told

    def with_obstacle(self, obstacle: Obstacle) -> VelocitySettings:
        """Returns the settings with an obstacle added, or with the obstacle of this name replaced."""
        obstacles = (*_without(self.htmpc.obstacles, obstacle.name), obstacle)
        return _with_htmpc(self, replace(self.htmpc, obstacles=obstacles))


LONGEST_DELAY = 1e3
"""Largest delay of a command, ms."""


def _htmpc(settings: VelocitySettings) -> HTMPCSettings:
    return settings.htmpc


def _with_htmpc(settings: VelocitySettings, htmpc: HTMPCSettings) -> VelocitySettings:
    return replace(settings, htmpc=htmpc)


def _stack(settings: VelocitySettings) -> Stack:
    return settings.htmpc.stack


def _with_stack(settings: VelocitySettings, stack: Stack) -> VelocitySettings:
    return _with_htmpc(settings, replace(settings.htmpc, stack=stack))


def _with_controller(settings: VelocitySettings, name: str) -> VelocitySettings:
    htmpc = replace(settings.htmpc, rate_hz=_RATE_HZ.get(name, 10.0))
    return replace(settings, controller=name, htmpc=htmpc)


def _with_formulation(settings: VelocitySettings, name: Any) -> VelocitySettings:
    htmpc = replace(settings.htmpc, formulation=name)
    stack = (replace(level, Q=STAGE_WEIGHT[htmpc.formulation]) for level in htmpc.stack)
    return _with_htmpc(settings, replace(htmpc, stack=tuple(stack)))


_LEVEL_KEYS = {key: level_key(key) for key in ("Q", "enabled")}
_BALL = Form(None, NUMBER, null=True)


@lru_cache(maxsize=64)
def _places(levels: tuple[str, ...], options: type[MissionOptions]) -> Mapping[str, Place]:
    """`VelocitySettings.places` for the names of the levels."""
    found = {
        **field_places(
            VelocitySettings, lambda s: s, lambda _, new: new, without=("htmpc", "plant", "options")
        ),
        **field_places(options, lambda s: s.options, lambda s, new: replace(s, options=new)),
        **field_places(
            HTMPCSettings, _htmpc, _with_htmpc, without=("stack", "limits", "obstacles", "delay_s")
        ),
        **field_places(
            MotionLimits,
            lambda s: s.htmpc.limits,
            lambda s, new: _with_htmpc(s, replace(s.htmpc, limits=new)),
            "limits.",
        ),
        **field_places(
            VelocityPlantSettings, lambda s: s.plant, lambda s, new: replace(s, plant=new), "plant."
        ),
        "Q": every_level("Q", _stack, _with_stack),
        **level_places(levels, _LEVEL_KEYS, _stack, _with_stack),
    }
    words = Form(WORD, words=tuple(VELOCITY_CONTROLLERS))
    found["controller"] = replace(found["controller"], write=_with_controller, form=words)
    found["formulation"] = replace(found["formulation"], write=_with_formulation)
    if "order" in found:
        found["order"] = replace(
            found["order"], own_fit=lambda s, _, value: tuple(l.name for l in ordered(_stack(s), value))
        )
    return MappingProxyType(found)


def _seen(settings: VelocitySettings, name: str) -> Any:
    found = [each for each in settings.htmpc.obstacles if each.name == name and not isinstance(each, Floor)]
    return _as_setting(found[0])[1] if found else None


def _put(name: str) -> Callable[[VelocitySettings, Obstacle | None], VelocitySettings]:
    def write(settings: VelocitySettings, obstacle: Obstacle | None) -> VelocitySettings:
        if obstacle is not None:
            return settings.with_obstacle(obstacle)
        return _with_htmpc(
            settings, replace(settings.htmpc, obstacles=_without(settings.htmpc.obstacles, name))
        )

    return write


def _split(obstacles: tuple[Obstacle, ...], last: int) -> tuple[tuple[Obstacle, ...], tuple[Obstacle, ...]]:
    at = len(obstacles) - last
    return obstacles[:at], obstacles[at:]


def _as_setting(obstacle: Ball | Box) -> tuple[str, Any]:
    where = (*obstacle.centre, obstacle.radius) if isinstance(obstacle, Ball) else obstacle.centre
    return f"obstacles.{obstacle.name}", where


def _without(obstacles: tuple[Obstacle, ...], name: str) -> tuple[Obstacle, ...]:
    return tuple(each for each in obstacles if each.name != name)


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
