"""Everything a learner can change, as one frozen tree, and the paths that reach into it."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Any, ClassVar, Literal, get_type_hints

from himpc.catalog import CONTROLLERS
from himpc.controllers import Settings as ControllerSettings
from himpc.limits import Limits
from himpc.references import Reference
from himpc.stack import Level, Stack
from himpc.tasks import Task
from lessons.events import Event, MoveLevel
from lessons.settings.levels import moved, ordered
from lessons.settings.settings import Fit, LevelKeys, Place, Settings, every_level, field_places, level_places
from lessons.settings.values import fitting, number, weight
from robots import InputError, NominalSettings, PlantSettings, Robot
from robots.errors import unknown_name
from robots.settings import PER_JOINT


@dataclass(frozen=True)
class SceneOptions(ABC):
    """What a scene lets one choose about its motion: a subclass has one field per choice, with its default.

    Each field is a path of its own (`--set smooth=true`). A change takes effect when a run starts.
    """

    @abstractmethod
    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """A fresh reference per task name, like `TorqueScene.references`."""


@dataclass(frozen=True)
class TorqueSettings(Settings):
    """Settings of a run; see `himpc.controllers.Settings` for the controller's own.

    Attributes:
        levels: the stack.
        M_bar: diagonal of M̄ before scaling.
        M_bar_scale: factor on all of it.
        nominal: what model-based controllers believe the plant to be.
        deadline_ms: a torque that is found later than this after its tick began acts one tick later; see
            `lessons.session.deadline`. 0: lockstep, time stands still while the controller computes.
        solve_ms_per_knot: how long the computer is assumed to take for each of the N knots, so that runs are
            the same everywhere. 0: the time it really takes, and then no two runs are the same.
        plant: what the plant really is.
        options: the scene's own choices, if it has any.
    """

    controllers: ClassVar[Mapping[str, str]] = CONTROLLERS

    levels: Stack
    M_bar: tuple[float, ...]
    controller: str = "himpc"
    M_bar_scale: float = 1.0
    horizon: int = 5
    T_s: float = 1e-3
    R_on: Literal["torque", "acceleration"] = "torque"
    route: Literal["compiled", "explicit"] = "compiled"
    solver: Literal["daqp", "proxqp", "qpoases"] = "daqp"
    damping: bool = True
    deadline_ms: float = 0.0
    solve_ms_per_knot: float = 0.1
    limits: Limits = field(default_factory=Limits)
    nominal: NominalSettings = field(default_factory=NominalSettings)
    plant: PlantSettings = field(default_factory=PlantSettings)
    options: SceneOptions | None = None

    def for_controller(self) -> ControllerSettings:
        """The controller's part. Raises InputError for values that cannot be."""
        if self.controller not in CONTROLLERS:
            raise unknown_name("controller", self.controller, CONTROLLERS)
        if not (math.isfinite(self.M_bar_scale) and self.M_bar_scale > 0):
            raise InputError(f"M_bar_scale is {self.M_bar_scale}: give a finite number above 0, e.g. 1")
        for name in ("deadline_ms", "solve_ms_per_knot"):
            if not 0.0 <= getattr(self, name) <= MAX_MS:
                raise InputError(f"{name} is {getattr(self, name)}: give a number from 0 to {MAX_MS:g}")
        return ControllerSettings(
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

    @property
    def measures_time(self) -> bool:
        return self.deadline_ms > 0 and self.solve_ms_per_knot == 0

    def takes(self, event: Event) -> bool:
        return isinstance(event, MoveLevel) or super().takes(event)

    def after(self, event: Event) -> TorqueSettings:
        if isinstance(event, MoveLevel):
            return replace(self, levels=moved(self.levels, event.level, event.to))
        return super().after(event)

    def places(self) -> dict[str, Place]:
        """Fields ("horizon", "M_bar", …) and those of the scene's options; "order", the names of all levels,
        highest priority first ("a,b,c" or a list); "Q" or "R" for all levels (one number, or one per level);
        "levels.NAME.KEY" with the level's name or its place 1 … r, KEY one of Q, R, horizon, enabled, K_p,
        K_v (gains of all its tasks); "tasks.NAME.K_p|K_v"; "limits.KEY"; "nominal.KEY"; "plant.KEY"."""
        without = ("levels", "options", *_PARTS)
        own = field_places(self, lambda settings: settings, lambda _, new: _checked(new), without=without)
        options = {}
        if self.options is not None:
            options = field_places(self.options, _part("options"), _with("options"))
        parts = [field_places(getattr(self, part), _part(part), _with(part), f"{part}.") for part in _PARTS]
        fit = own["route"].fit
        own["route"] = replace(own["route"], fit=lambda path, value: fit(path, _now(value)))
        return {
            **own,
            **options,
            "order": Place(
                lambda s: tuple(level.name for level in s.levels),
                _with("levels"),
                lambda _, value: ordered(self.levels, value),
            ),
            **{key: every_level(self.levels, key, _levels, _with("levels")) for key in ("Q", "R")},
            **level_places(self.levels, _LEVEL_KEYS, _levels, _with("levels")),
            **{
                f"tasks.{task.name}.{key}": _gain(task.name, key)
                for level in self.levels
                for task in level.tasks
                for key in _GAINS
            },
            **{path: place for part in parts for path, place in part.items()},
        }

    def special(self, path: str, value: Any) -> TorqueSettings | None:
        """Where a value holds one number per joint ("M_bar", "plant.inertia_scale", …), a place 1 … n behind
        it means that joint's alone: "M_bar.3"."""
        whole, _, place = path.rpartition(".")
        if not place.isdigit() or whole not in self._per_joint():
            return None
        n = len(self.M_bar)
        if not 1 <= int(place) <= n:
            raise InputError(f"{path}: there is no joint {place}; give a place from 1 to {n}")
        now = self.value_at(whole)
        values = list(now) if isinstance(now, tuple) else [float(now)] * n
        values[int(place) - 1] = number(path, value)
        return self.changed(whole, tuple(values))

    def _per_joint(self) -> list[str]:
        """Paths whose value may be one number per joint."""
        parts = [
            f"{part}.{each.name}"
            for part in ("nominal", "plant")
            for each in fields(getattr(self, part))
            if each.name in PER_JOINT
        ]
        return ["M_bar", *parts]


MAX_MS = 1e3
"""Largest deadline and time per knot."""

_GAINS = ("K_p", "K_v")
_PARTS = ("limits", "nominal", "plant")


def _now(route: Any) -> Any:
    """Codes and scripts of earlier versions may name a route that another one took the place of."""
    return "compiled" if route == "structured" else route


def _checked(settings: TorqueSettings) -> TorqueSettings:
    settings.for_controller()
    return settings


def _part(name: str) -> Callable[[TorqueSettings], Any]:
    return lambda settings: getattr(settings, name)


def _with(name: str) -> Callable[[TorqueSettings, Any], TorqueSettings]:
    return lambda settings, part: replace(settings, **{name: part})


def _levels(settings: TorqueSettings) -> Stack:
    return settings.levels


def _level_key(key: str) -> tuple[Callable[[Level], Any], Callable[[Level, Any], Level], Fit, bool]:
    hint = get_type_hints(Level)[key]

    def put(level: Level, value: Any) -> Level:
        return replace(level, **{key: value})

    return lambda level: getattr(level, key), put, lambda path, value: fitting(path, hint, value), False


def _level_gain(key: str) -> tuple[Callable[[Level], Any], Callable[[Level, Any], Level], Fit, bool]:
    def put(level: Level, value: Any) -> Level:
        return replace(level, tasks=tuple(replace(task, **{key: value}) for task in level.tasks))

    return lambda level: getattr(level.tasks[0], key), put, weight, True


_LEVEL_KEYS: LevelKeys = {
    **{key: _level_key(key) for key in ("Q", "R", "horizon", "enabled")},
    **{key: _level_gain(key) for key in _GAINS},
}


def _gain(name: str, key: str) -> Place:
    def task(settings: TorqueSettings) -> Task:
        return next(task for level in settings.levels for task in level.tasks if task.name == name)

    def write(settings: TorqueSettings, value: Any) -> TorqueSettings:
        def put(task: Task) -> Task:
            return replace(task, **{key: value}) if task.name == name else task

        levels = (replace(level, tasks=tuple(map(put, level.tasks))) for level in settings.levels)
        return replace(settings, levels=tuple(levels))

    return Place(lambda settings: getattr(task(settings), key), write, weight)
