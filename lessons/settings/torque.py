"""All settings of a torque-level scene, as one frozen tree, and their paths."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import lru_cache
from types import MappingProxyType
from typing import Annotated, Any, ClassVar, Literal

from himpc.catalog import CONTROLLERS
from himpc.controllers import Settings as ControllerSettings
from himpc.formulation.settings import Horizon, Period
from himpc.limits import Limits
from himpc.limits.avoidance import Avoidance
from himpc.qp import Solver
from himpc.references import Reference
from himpc.stack import Level, Stack
from himpc.tasks import Task
from lessons.events import Event, MoveLevel
from lessons.own.files import by_name, is_file, with_fingerprint
from lessons.settings.entry import Entry
from lessons.settings.levels import moved, ordered
from lessons.settings.settings import (
    LevelKey,
    Place,
    SceneSettings,
    every_level,
    field_places,
    level_key,
    level_places,
)
from lessons.settings.stack import Own, read_stack, same_tasks, told
from lessons.settings.stack_changes import CHANGES, add
from lessons.settings.torque_entries import TORQUE_ENTRIES
from lessons.settings.values import WORD, Form, form_of
from robots import InputError, NominalSettings, PlantSettings, Robot
from robots.errors import shortened, unknown_name
from robots.ranges import Range, check_fields, field_types


@dataclass(frozen=True)
class SceneOptions(ABC):
    """The options of a scene's motion: a subclass has one field per option, with its default.

    Each field is a path of its own (`--set smooth=true`). A change takes effect when a run starts.
    """

    @abstractmethod
    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """Returns a fresh reference per task name, like `TorqueScene.references`."""


Milliseconds = Annotated[float, Range(0.0, 1e3)]


@dataclass(frozen=True)
class TorqueSettings(SceneSettings):
    """Settings of a run; see `himpc.controllers.Settings` for the controller's own.

    Attributes:
        levels: the stack.
        M_bar: diagonal of M̄ before scaling.
        M_bar_scale: factor on the whole diagonal.
        M_bar_adapt: whether the controller adapts M̄ to the payload, see `himpc.controllers.adaptation`.
        nominal: the plant as the nominal model of model-based controllers describes it.
        deadline_ms: a torque that is ready later than this after the beginning of its tick acts one tick
            later; see `lessons.session.deadline`. 0: lockstep, simulated time waits while the controller
            computes.
        solve_ms_per_knot: assumed computing time for each of the N knots, so that runs are the same
            everywhere. 0: the measured computing time, and then no two runs are the same.
        plant: the parameters of the simulated plant.
        options: the scene's own choices, if it has any.
        files: users' Python files that can be selected as the controller. No setting's path changes them:
            data from elsewhere (a code, a page) must not choose which files are executed.
        own_tasks: (path of the file, task) of users' Python files whose tasks the stack can name; no
            setting's path changes them.
    """

    entries: ClassVar[tuple[Entry, ...]] = TORQUE_ENTRIES

    levels: Stack
    M_bar: Annotated[tuple[float, ...], Range(0.0, above=True)]
    controller: str = "himpc"
    M_bar_scale: Annotated[float, Range(0.0, above=True)] = 1.0
    M_bar_adapt: bool = False
    horizon: Horizon = 5
    T_s: Period = 1e-3
    R_on: Literal["torque", "acceleration"] = "torque"
    solver: Solver = "daqp"
    damping: bool = True
    deadline_ms: Milliseconds = 0.0
    solve_ms_per_knot: Milliseconds = 0.1
    limits: Limits = field(default_factory=Limits)
    nominal: NominalSettings = field(default_factory=NominalSettings)
    plant: PlantSettings = field(default_factory=PlantSettings)
    options: SceneOptions | None = None
    files: tuple[str, ...] = field(default=(), compare=False)
    own_tasks: tuple[tuple[str, Task], ...] = field(default=(), compare=False)

    @property
    def controllers(self) -> Mapping[str, str]:
        return CONTROLLERS | dict.fromkeys(self.files, "a controller of your own, in a file of this machine")

    def for_controller(self) -> ControllerSettings:
        """Returns the part of the settings for the controller. Raises InputError for invalid values."""
        if self.controller not in self.controllers:
            raise unknown_name("controller", self.controller, by_name(self.controllers))
        check_fields(self)
        return ControllerSettings(
            stack=self.levels,
            M_bar=tuple(float(value) * self.M_bar_scale for value in self.M_bar),
            M_bar_adapt=self.M_bar_adapt,
            horizon=self.horizon,
            T_s=self.T_s,
            limits=self.limits,
            solver=self.solver,
            R_on=self.R_on,
            damping=self.damping,
            nominal=self.nominal,
        )

    def is_late(self, measured_ms: float) -> bool:
        """Returns whether a torque with this computing time misses its deadline."""
        assumed = self.solve_ms_per_knot * self.horizon
        # N times a decimal fraction has a rounding error. A torque that exactly meets its deadline must
        # not count as late.
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

    def places(self) -> Mapping[str, Place]:
        """Fields ("horizon", "M_bar", …) and those of the scene's options; "stack", a list of levels as
        `lessons.settings.stack.read_stack` reads it; "order", the names of all levels,
        highest priority first ("a,b,c" or a list); "Q" or "R" for all levels (one number, or one per level);
        "levels.NAME.KEY" with the level's name or its place 1 … r, KEY one of Q, R, horizon, enabled, K_p,
        K_v (gains of all its tasks); "tasks.NAME.K_p|K_v"; "limits.KEY"; "avoidance.KEY"; "nominal.KEY";
        "plant.KEY". If a value has one number per joint, a place 1 … n after the path selects the number of
        that joint: "M_bar.3"."""
        levels = tuple((level.name, tuple(task.name for task in level.tasks)) for level in self.levels)
        return _places(levels, type(self.options), tuple(self.controllers))

    def elements(self, path: str) -> int:
        form = self.places()[path].form
        per_joint = path.startswith(("M_bar", "nominal.", "plant.")) and form.elements is not None
        return len(self.M_bar) if per_joint else 0

    def place(self, path: str) -> Place:
        """As in `Settings`, and also "stack.add" and the other `CHANGES`, which change a part of the stack,
        and "route", see `_with_route`."""
        return _CHANGE_PLACES.get(path) or super().place(path)

    def recomposed(self, wanted: TorqueSettings) -> list[tuple[str, Any]]:
        return (
            []
            if same_tasks(self.levels, wanted.levels)
            else [("stack", told(wanted.levels, dict(wanted.own_tasks)))]
        )


_GAINS = ("K_p", "K_v")
_PARTS = {"limits": Limits, "nominal": NominalSettings, "plant": PlantSettings}


def _with_route(settings: TorqueSettings, route: str) -> TorqueSettings:
    """Codes and scripts of earlier versions may name a route. `explicit` is now a controller. For controllers
    other than himpc, both routes had the same torques."""
    printed = route == "explicit" and settings.controller == "himpc"
    return replace(settings, controller="himpc_printed") if printed else settings


def _known(form: Form, path: str, name: Any) -> Any:
    if isinstance(name, str) and ".py@" in name:
        return with_fingerprint(name, form.words, "controller")
    if isinstance(name, str) and is_file(name) and name not in form.words:
        raise InputError(
            f"{path} is {shortened(name, 100)}: to use a file of your own, start himpc-lab with "
            "--controller FILE.py"
        )
    return form.fit(path, name)


def _checked(settings: TorqueSettings) -> TorqueSettings:
    settings.for_controller()
    return settings


def _part(name: str) -> Callable[[TorqueSettings], Any]:
    return lambda settings: getattr(settings, name)


def _with(name: str) -> Callable[[TorqueSettings, Any], TorqueSettings]:
    return lambda settings, part: replace(settings, **{name: part})


def _with_avoidance(settings: TorqueSettings, avoidance: Avoidance) -> TorqueSettings:
    return replace(settings, limits=replace(settings.limits, avoidance=avoidance))


def _levels(settings: TorqueSettings) -> Stack:
    return settings.levels


def _level_gain(key: str) -> LevelKey:
    def put(level: Level, value: Any) -> Level:
        return replace(level, tasks=tuple(replace(task, **{key: value}) for task in level.tasks))

    return LevelKey(lambda level: getattr(level.tasks[0], key), put, _GAIN_FORMS[key], shorthand=True)


_GAIN_FORMS = {key: form_of(field_types(Task)[key]) for key in _GAINS}
_LEVEL_KEYS = {
    **{key: level_key(key) for key in ("Q", "R", "horizon", "enabled")},
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

    return Place(lambda settings: getattr(task(settings), key), write, _GAIN_FORMS[key])


def _stack_place(change: Callable[[TorqueSettings, Any], Stack], read: Callable[..., Any] = _levels) -> Place:
    """Returns a place at which a written value changes the stack."""
    return Place(
        read, _with("levels"), Form(None, WORD), lambda s, _, value: change(s, value), shorthand=True
    )


def _own(settings: TorqueSettings) -> Own:
    return dict(settings.own_tasks)


_CHANGE_PLACES = {
    **{path: _stack_place(lambda s, value, to=to: to(s.levels, value)) for path, to in CHANGES.items()},
    "stack.add": _stack_place(lambda s, value: add(s.levels, value, _own(s))),
    "route": Place(
        lambda settings: "explicit" if settings.controller == "himpc_printed" else "compiled",
        lambda settings, route: _checked(_with_route(settings, route)),
        Form(WORD, words=("compiled", "explicit", "structured")),
        shorthand=True,
    ),
}


@lru_cache(maxsize=64)
def _places(
    levels: tuple[tuple[str, tuple[str, ...]], ...], options: type[Any], controllers: tuple[str, ...]
) -> Mapping[str, Place]:
    """`TorqueSettings.places` for the names of the levels and of their tasks."""
    without = ("levels", "options", "files", "own_tasks", *_PARTS)
    found = field_places(TorqueSettings, lambda s: s, lambda _, new: _checked(new), without=without)
    form = Form(WORD, words=controllers)
    found["controller"] = replace(
        found["controller"], form=form, own_fit=lambda _, path, name: _known(form, path, name)
    )
    if options is not type(None):
        found |= field_places(options, _part("options"), _with("options"))
    order = _stack_place(lambda s, value: ordered(s.levels, value), lambda s: tuple(l.name for l in s.levels))
    found["order"] = replace(order, shorthand=False)
    found["stack"] = _stack_place(
        lambda s, value: read_stack(value, s.levels, _own(s)), lambda s: told(s.levels, _own(s))
    )
    found |= {key: every_level(key, _levels, _with("levels")) for key in ("Q", "R")}
    found |= level_places([name for name, _ in levels], _LEVEL_KEYS, _levels, _with("levels"))
    for task in (task for _, tasks in levels for task in tasks):
        found |= {f"tasks.{task}.{key}": _gain(task, key) for key in _GAINS}
    for part, of in _PARTS.items():
        found |= field_places(of, _part(part), _with(part), f"{part}.", without=("avoidance",))
    found |= field_places(Avoidance, lambda s: s.limits.avoidance, _with_avoidance, "avoidance.")
    return MappingProxyType(found)
