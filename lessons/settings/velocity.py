"""Everything a learner can change in a velocity-level scene, and the paths that reach into it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, get_type_hints

from himpc.catalog import VELOCITY_CONTROLLERS
from himpc.htmpc import HTMPCSettings
from himpc.stack import Level, Stack
from lessons.settings.levels import ordered
from lessons.settings.missions import MobileOptions, Stay
from lessons.settings.values import fitting, typed, weight
from robots import InputError, VelocityPlantSettings
from robots.collision import Ball, Box, Floor, Obstacle
from robots.errors import unknown_name

STAGE_WEIGHT: dict[str, float] = {"proximal": 10.0, "paper": 1.0}
"""Q of (8) that each formulation was tuned with; choosing a formulation sets it."""

_RATE_HZ = {"htidkc": 50.0}
"""Control rate that goes with a controller, 10 Hz for all others; choosing a controller sets it."""


@dataclass(frozen=True)
class MobileSettings:
    """Settings of a velocity-level run.

    Attributes:
        htmpc: the controller's; its stack holds one level per role, and the mission's window orders them.
        controller: which of VELOCITY_CONTROLLERS.
        compensate_delay: predict the measured state forward by the plant's lag before planning.
        delay_measured: a plan's commands arrive later by the time its computation really took, on top of
            `plant.delay_ms`, as on a robot that does not wait; no two runs are the same then.
        plant: what the plant really is.
        options: the scene's own choices.
    """

    htmpc: HTMPCSettings
    controller: str = "htmpc"
    compensate_delay: bool = True
    delay_measured: bool = False
    plant: VelocityPlantSettings = field(default_factory=VelocityPlantSettings)
    options: MobileOptions = field(default_factory=Stay)

    def __post_init__(self) -> None:
        """Raises InputError for a controller that does not exist."""
        if self.controller not in VELOCITY_CONTROLLERS:
            raise unknown_name("velocity-level controller", self.controller, VELOCITY_CONTROLLERS)

    def felt(self, solve_ms: float) -> VelocityPlantSettings:
        """The plant that the commands of a plan meet which took so many ms to compute."""
        if not self.delay_measured:
            return self.plant
        return replace(self.plant, delay_ms=min(self.plant.delay_ms + solve_ms, LONGEST_DELAY))

    @property
    def levels(self) -> Stack:
        """One level per role."""
        return self.htmpc.stack

    @property
    def horizon(self) -> int:
        """N, knots."""
        return self.htmpc.horizon

    @property
    def T_s(self) -> float:
        """Control period, s."""
        return self.htmpc.period

    @property
    def lexicographic_delta(self) -> float | None:
        """δ of (12), m (or rad); None if levels below are held by something else."""
        by_error = self.controller in ("htmpc", "htmpc_wpt") and self.htmpc.lexicographic == "per_coordinate"
        return self.htmpc.delta_m if by_error else None


LONGEST_DELAY = 1e3
"""ms between a command and the plant at most."""
_PARTS = ("limits", "plant")
_OWN = ("controller", "compensate_delay", "delay_measured")
_LEVEL_KEYS = ("Q", "enabled")
_NOT_SETTABLE = ("stack", "limits", "obstacles", "delay_s")


def changed(settings: MobileSettings, path: str, value: Any) -> MobileSettings:
    """The settings with the value at a path replaced.

    Paths: a field of HTMPCSettings ("horizon", "delta_m", "formulation", …), "controller",
    "compensate_delay", "delay_measured", the fields of the scene's options ("peak", "seats", …; "order" takes
    effect when a run starts), "limits.KEY", "plant.KEY", "Q" for all levels (a new formulation brings its
    own), "levels.NAME.Q|enabled" with the level's name or its place 1 … r, and "obstacles.NAME" for a ball
    [x, y, z, radius], new or instead of the obstacle of that name, for where one is now, [x, y, z], or None
    to take it away.

    Raises:
        InputError: unknown path (naming the nearest), or a value of the wrong type or range.
    """
    head, _, rest = path.partition(".")
    htmpc = settings.htmpc
    if head == "obstacles" and rest:
        known = {each.name: each for each in htmpc.obstacles if not isinstance(each, Floor)}
        if value is not None:
            return with_obstacle(settings, _obstacle(known, path, rest, value))
        if rest not in known:
            raise unknown_name("obstacle", rest, known)
        return replace(settings, htmpc=replace(htmpc, obstacles=_without(htmpc.obstacles, rest)))
    if path not in paths(settings):
        raise unknown_name("setting", path, paths(settings))
    if path == "order":
        value = [level.name for level in ordered(htmpc.stack, value)]
    if head == "Q":
        values = value if isinstance(value, (list, tuple)) else [value] * len(htmpc.stack)
        if len(values) != len(htmpc.stack):
            raise InputError(f"Q has {len(values)} values: give one number, or one per level")
        levels = (
            replace(level, Q=weight(f"Q of level '{level.name}'", each))
            for level, each in zip(htmpc.stack, values, strict=True)
        )
        return replace(settings, htmpc=replace(htmpc, stack=tuple(levels)))
    if head == "levels":
        name, _, key = rest.rpartition(".")
        fitted = typed(path, True, value) if key == "enabled" else weight(path, value)
        stack = _with_level(htmpc.stack, name, lambda level: replace(level, **{key: fitted}))
        return replace(settings, htmpc=replace(htmpc, stack=stack))
    if head == "limits":
        return replace(settings, htmpc=replace(htmpc, limits=_with(htmpc.limits, rest, path, value)))
    if head == "plant":
        return replace(settings, plant=_with(settings.plant, rest, path, value))
    if head in _OWN:
        settings = _with(settings, head, path, value)
        if head != "controller":
            return settings
        return replace(settings, htmpc=replace(htmpc, rate_hz=_RATE_HZ.get(settings.controller, 10.0)))
    if head in _names(settings.options):
        return replace(settings, options=_with(settings.options, head, path, value))
    htmpc = _with(htmpc, head, path, value)
    if head == "formulation":
        Q = STAGE_WEIGHT[htmpc.formulation]
        htmpc = replace(htmpc, stack=tuple(replace(level, Q=Q) for level in htmpc.stack))
    return replace(settings, htmpc=htmpc)


def paths(settings: MobileSettings) -> list[str]:
    """Every path that `changed` takes for these settings."""
    stack = settings.htmpc.stack
    names = [*(str(place) for place in range(1, len(stack) + 1)), *(level.name for level in stack)]
    return [
        *_OWN,
        *_names(settings.options),
        *(name for name in _names(settings.htmpc) if name not in _NOT_SETTABLE),
        *(f"limits.{name}" for name in _names(settings.htmpc.limits)),
        *(f"plant.{name}" for name in _names(settings.plant)),
        "Q",
        *(f"levels.{name}.{key}" for name in names for key in _LEVEL_KEYS),
    ]


def value_at(settings: MobileSettings, path: str) -> Any:
    """The value at one of `paths`, but for "Q" of all levels."""
    head, _, rest = path.partition(".")
    if head == "levels":
        name, _, key = rest.rpartition(".")
        return next(getattr(level, key) for level in settings.htmpc.stack if level.name == name)
    if rest:
        return getattr(settings.plant if head == "plant" else settings.htmpc.limits, rest)
    if head in _OWN:
        return getattr(settings, head)
    return getattr(settings.options if head in _names(settings.options) else settings.htmpc, head)


def with_obstacle(settings: MobileSettings, obstacle: Obstacle) -> MobileSettings:
    """The settings with an obstacle more, or instead of the one of its name."""
    htmpc = settings.htmpc
    obstacles = (*_without(htmpc.obstacles, obstacle.name), obstacle)
    return replace(settings, htmpc=replace(htmpc, obstacles=obstacles))


def _without(obstacles: tuple[Obstacle, ...], name: str) -> tuple[Obstacle, ...]:
    return tuple(each for each in obstacles if each.name != name)


def _obstacle(known: Mapping[str, Ball | Box], path: str, name: str, value: Any) -> Obstacle:
    numbers = weight(path, value)
    if isinstance(numbers, tuple) and len(numbers) == 4:
        x, y, z, radius = numbers
        return Ball(name, (x, y, z), radius)
    if isinstance(numbers, tuple) and len(numbers) == 3 and name in known:
        x, y, z = numbers
        return replace(known[name], centre=(x, y, z))
    movable = f", or move {', '.join(known)} to [x, y, z], or take one away by null" if known else ""
    raise InputError(
        f"{path} is {value!r}: give a ball as [x, y, z, radius] in m, e.g. [2, 0, 1, 0.3]{movable}"
    )


def _names(part: Any) -> list[str]:
    return [each.name for each in fields(part)]


def _with(part: Any, name: str, path: str, value: Any) -> Any:
    return replace(part, **{name: fitting(path, get_type_hints(type(part))[name], value)})


def _with_level(stack: Stack, name: str, update: Callable[[Level], Level]) -> Stack:
    return tuple(
        update(level) if name in (level.name, str(place)) else level
        for place, level in enumerate(stack, start=1)
    )
