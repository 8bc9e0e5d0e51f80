"""Everything a learner can change, as one frozen tree, and the paths that reach into it."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, Literal

from himpc.catalog import CONTROLLERS
from himpc.controllers import Settings
from himpc.limits import Limits
from himpc.references import Reference
from himpc.stack import Level, Stack
from lessons.settings.levels import ordered
from lessons.settings.values import number, typed, weight
from robots import InputError, NominalSettings, PlantSettings, Robot
from robots.errors import unknown_name
from robots.settings import PER_JOINT


@dataclass(frozen=True)
class SceneOptions:
    """What a scene lets one choose about its motion: a subclass has one field per choice, with its default.

    Each field is a path of its own (`--set smooth=true`). A change takes effect when a run starts.
    """

    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """A fresh reference per task name, like `Scene.references`."""
        raise NotImplementedError


@dataclass(frozen=True)
class SceneSettings:
    """Settings of a run; see `himpc.controllers.Settings` for the controller's own.

    Attributes:
        levels: the stack.
        M_bar: diagonal of M̄ before scaling.
        M_bar_scale: factor on all of it.
        nominal: what model-based controllers believe the plant to be.
        deadline_ms: a torque that is found later than this after its tick began acts one tick later; see
            `lessons.session.torque.deadline`. 0: lockstep, time stands still while the controller computes.
        solve_ms_per_knot: how long the computer is assumed to take for each of the N knots, so that runs are
            the same everywhere. 0: the time it really takes, and then no two runs are the same.
        plant: what the plant really is.
        options: the scene's own choices, if it has any.
    """

    levels: Stack
    M_bar: tuple[float, ...]
    controller: str = "himpc"
    M_bar_scale: float = 1.0
    horizon: int = 5
    T_s: float = 1e-3
    R_on: Literal["torque", "acceleration"] = "torque"
    route: Literal["structured", "explicit"] = "structured"
    solver: Literal["daqp", "proxqp", "qpoases"] = "daqp"
    damping: bool = True
    deadline_ms: float = 0.0
    solve_ms_per_knot: float = 0.1
    limits: Limits = field(default_factory=Limits)
    nominal: NominalSettings = field(default_factory=NominalSettings)
    plant: PlantSettings = field(default_factory=PlantSettings)
    options: SceneOptions | None = None

    def for_controller(self) -> Settings:
        """The controller's part. Raises InputError for values that cannot be."""
        if self.controller not in CONTROLLERS:
            raise unknown_name("controller", self.controller, CONTROLLERS)
        if not (math.isfinite(self.M_bar_scale) and self.M_bar_scale > 0):
            raise InputError(f"M_bar_scale is {self.M_bar_scale}: give a finite number above 0, e.g. 1")
        for name in ("deadline_ms", "solve_ms_per_knot"):
            if not 0.0 <= getattr(self, name) <= MAX_MS:
                raise InputError(f"{name} is {getattr(self, name)}: give a number from 0 to {MAX_MS:g}")
        return Settings(
            stack=self.levels,
            M_bar=tuple(float(value) * self.M_bar_scale for value in self.M_bar),
            horizon=self.horizon,
            T_s=self.T_s,
            limits=self.limits,
            route=self.route,
            solver=self.solver,
            R_on=self.R_on,
            damping=self.damping,
            nominal=self.nominal,
        )

    def is_late(self, measured_ms: float) -> bool:
        """Whether a torque that took so long to compute misses its deadline."""
        assumed = self.solve_ms_per_knot * self.horizon
        # N times a decimal fraction must not miss a deadline that it exactly meets.
        return 0.0 < self.deadline_ms < (assumed or measured_ms) - 1e-9


MAX_MS = 1e3
"""Largest deadline and time per knot."""

_LEVEL_KEYS = ("Q", "R", "horizon", "enabled", "K_p", "K_v")
_TASK_KEYS = ("K_p", "K_v")
_EVERY_LEVEL = ("Q", "R")
_PARTS = ("limits", "nominal", "plant")


def changed(settings: SceneSettings, path: str, value: Any) -> SceneSettings:
    """The settings with the value at a path replaced.

    Paths: a field ("horizon", "M_bar", …); "order", the names of all levels, highest priority first
    ("a,b,c" or a list); "Q" or "R" for all levels (one number, or one per level);
    "levels.NAME.KEY" with the level's name or its place 1 … r, KEY one of Q, R, horizon, enabled, K_p, K_v
    (gains of all its tasks); "tasks.NAME.K_p|K_v"; "limits.KEY"; "nominal.KEY"; "plant.KEY"; the fields of
    the scene's options. Where a value holds one number per joint ("M_bar", "plant.inertia_scale", …), a place
    1 … n behind it means that joint's alone: "M_bar.3".

    Raises:
        InputError: unknown path (naming the nearest), or a value of the wrong type or range.
    """
    head, _, rest = path.partition(".")
    whole, _, place = path.rpartition(".")
    if place.isdigit() and whole in _per_joint(settings):
        return changed(settings, whole, _one_joint(settings, path, whole, int(place), value))
    if head in _EVERY_LEVEL and not rest:
        return _every_level(settings, head, value)
    if path == "order":
        return replace(settings, levels=ordered(settings.levels, value))
    if head == "levels":
        return _in_level(settings, path, rest, value)
    if head == "tasks":
        return _in_task(settings, path, rest, value)
    if head in _PARTS:
        part = getattr(settings, head)
        names = [f.name for f in fields(part)]
        if rest not in names:
            raise _unknown_path(settings, path)
        return replace(settings, **{head: replace(part, **{rest: typed(path, getattr(part, rest), value)})})
    options = settings.options
    if options is not None and path in _option_fields(settings):
        choice = typed(path, getattr(options, path), value)
        return replace(settings, options=replace(options, **{path: choice}))
    if rest or head not in _plain_fields():
        raise _unknown_path(settings, path)
    updated = replace(settings, **{head: typed(path, getattr(settings, head), value)})
    updated.for_controller()
    return updated


def paths(settings: SceneSettings) -> list[str]:
    """Every path that `changed` takes for these settings."""
    return [
        *_plain_fields(),
        *_option_fields(settings),
        "order",
        *_EVERY_LEVEL,
        *(f"levels.{place}.{key}" for place in range(1, len(settings.levels) + 1) for key in _LEVEL_KEYS),
        *(f"levels.{level.name}.{key}" for level in settings.levels for key in _LEVEL_KEYS),
        *(
            f"tasks.{task.name}.{key}"
            for level in settings.levels
            for task in level.tasks
            for key in _TASK_KEYS
        ),
        *(f"{part}.{f.name}" for part in _PARTS for f in fields(getattr(settings, part))),
    ]


def value_at(settings: SceneSettings, path: str) -> Any:
    """The value at one of `paths`, but for "Q" and "R" of all levels and the gains of a level."""
    head, _, rest = path.partition(".")
    if path == "order":
        return tuple(level.name for level in settings.levels)
    if head == "levels":
        name, _, key = rest.rpartition(".")
        return next(getattr(level, key) for level in settings.levels if level.name == name)
    if head == "tasks":
        name, _, key = rest.rpartition(".")
        tasks = (task for level in settings.levels for task in level.tasks)
        return next(getattr(task, key) for task in tasks if task.name == name)
    owner = settings.options if path in _option_fields(settings) else settings
    return getattr(getattr(settings, head), rest) if rest else getattr(owner, path)


def _per_joint(settings: SceneSettings) -> list[str]:
    """Paths whose value may be one number per joint."""
    parts = [
        f"{part}.{f.name}"
        for part in ("nominal", "plant")
        for f in fields(getattr(settings, part))
        if f.name in PER_JOINT
    ]
    return ["M_bar", *parts]


def _one_joint(settings: SceneSettings, path: str, whole: str, place: int, value: Any) -> tuple[float, ...]:
    """The value at `whole` as a list with one entry replaced."""
    n = len(settings.M_bar)
    if not 1 <= place <= n:
        raise InputError(f"{path}: there is no joint {place}; give a place from 1 to {n}")
    part, _, key = whole.rpartition(".")
    now = getattr(getattr(settings, part) if part else settings, key)
    values = list(now) if isinstance(now, tuple) else [float(now)] * n
    values[place - 1] = number(path, value)
    return tuple(values)


def _plain_fields() -> list[str]:
    return [f.name for f in fields(SceneSettings) if f.name not in ("levels", "options", *_PARTS)]


def _option_fields(settings: SceneSettings) -> list[str]:
    return [] if settings.options is None else [f.name for f in fields(settings.options)]


def _unknown_path(settings: SceneSettings, path: str) -> InputError:
    return unknown_name("setting", path, paths(settings))


def _every_level(settings: SceneSettings, key: str, value: Any) -> SceneSettings:
    values = value if isinstance(value, (list, tuple)) else [value] * len(settings.levels)
    if len(values) != len(settings.levels):
        raise InputError(f"{key} has {len(values)} values: give one number, or one per level")
    levels = [
        replace(level, **{key: weight(f"{key} of level '{level.name}'", each)})
        for level, each in zip(settings.levels, values, strict=True)
    ]
    return replace(settings, levels=tuple(levels))


def _in_level(settings: SceneSettings, path: str, rest: str, value: Any) -> SceneSettings:
    name, _, key = rest.rpartition(".")
    names = [level.name for level in settings.levels]
    if name.isdigit() and 1 <= int(name) <= len(names):
        name = names[int(name) - 1]
    if name not in names or key not in _LEVEL_KEYS:
        raise _unknown_path(settings, path)

    def update(level: Level) -> Level:
        if key in _TASK_KEYS:
            gain = weight(path, value)
            return replace(level, tasks=tuple(replace(task, **{key: gain}) for task in level.tasks))
        if key in ("Q", "R"):
            return replace(level, **{key: weight(path, value)})
        if key == "horizon":
            return replace(level, horizon=None if value is None else typed(path, 1, value))
        return replace(level, enabled=typed(path, True, value))

    return _updated(settings, name, update)


def _in_task(settings: SceneSettings, path: str, rest: str, value: Any) -> SceneSettings:
    name, _, key = rest.rpartition(".")
    owner = {task.name: level.name for level in settings.levels for task in level.tasks}
    if name not in owner or key not in _TASK_KEYS:
        raise _unknown_path(settings, path)
    gain = weight(path, value)

    def update(level: Level) -> Level:
        tasks = (replace(task, **{key: gain}) if task.name == name else task for task in level.tasks)
        return replace(level, tasks=tuple(tasks))

    return _updated(settings, owner[name], update)


def _updated(settings: SceneSettings, name: str, update: Callable[[Level], Level]) -> SceneSettings:
    levels = tuple(update(level) if level.name == name else level for level in settings.levels)
    return replace(settings, levels=levels)
