"""All settings of a torque-level scene, as one frozen tree, and their paths."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field, fields, replace
from typing import Annotated, Any, ClassVar

from himpc.catalog import CONTROLLERS
from himpc.controllers import Settings as ControllerSettings
from himpc.references import Reference
from himpc.stack import Stack
from himpc.tasks import Task
from lessons.events import Event, MoveLevel
from lessons.own.files import by_name, is_file, with_fingerprint
from lessons.settings.schema import Setting, Shape, setting_of_all_levels, settings_of_levels
from lessons.settings.settings import SceneSettings
from lessons.settings.stack import CHANGES, Own, add, moved, ordered, read_stack, same_tasks, stack_as_data
from lessons.settings.values import WORD, Form
from robots import InputError, PlantSettings, Robot
from robots.errors import shortened, unknown_name
from robots.ranges import SCALE, Range, Shown


@dataclass(frozen=True)
class SceneOptions(ABC):
    """The options of a scene's motion: a subclass has one field per option, with its default.

    Each field is a path of its own (`--set smooth=true`). A change takes effect when a run starts.
    """

    @abstractmethod
    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """Returns a fresh reference per task name, like `TorqueScene.references`."""


@dataclass(frozen=True)
class TorqueSettings(ControllerSettings, SceneSettings):
    """Settings of a run: those of the controller (`himpc.controllers.Settings`), the plant and the scene.

    Attributes:
        M_bar: diagonal of M̄ before scaling, unlike that of the controller.
        deadline_ms: a torque that is ready later than this after the beginning of its tick acts one tick
            later; see `lessons.session.commands`. 0: lockstep, simulated time waits while the controller
            computes.
        solve_ms_per_knot: assumed computing time for each of the N knots, so that runs are the same
            everywhere. 0: the measured computing time, and then no two runs are the same.
        options: the scene's own choices, if it has any.
        files: users' Python files that can be selected as the controller. No setting's path changes them:
            data from elsewhere (a code, a page) must not choose which files are executed.
        own_tasks: (path of the file, task) of users' Python files whose tasks the stack can name; no
            setting's path changes them.
    """

    page_order: ClassVar[tuple[str, ...]] = (
        "controller", "horizon", "T_s", "deadline_ms", "solve_ms_per_knot", "M_bar_scale", "M_bar_adapt",
        "M_bar", "limits.position", "limits", "avoidance", "", "order", "stack", "Q", "R", "levels", "tasks",
        "plant", "nominal",
    )  # fmt: skip

    # fmt: off
    controller: Annotated[str, Shown(
        "Controller", "You can switch the controller while the robot moves; within a few tenths of a second, "
        "the torque becomes that of the new controller")] = "himpc"
    M_bar_scale: Annotated[float, SCALE, Shown(
        "M̄ scale", "One factor on the whole diagonal of M̄", "", 0.1, 5.0, 0.05,
        tries=("4", "2", "1", "0.5"), group="Inertia estimate M̄")] = 1.0
    deadline_ms: Annotated[float, Range(0.0, 1e3), Shown(
        "Due after", "A torque that is computed later than this acts one tick later; until then the previous "
        "torque is held. 0: simulated time waits while the controller computes", "ms", 0.0, 5.0, 0.1,
        group="Deadline")] = 0.0
    solve_ms_per_knot: Annotated[float, Range(0.0, 1e3), Shown(
        "Per knot", "Assumed computing time per knot of the horizon. 0: the measured computing time of this "
        "computer", "ms", 0.0, 0.5, 0.01, group="Deadline")] = 0.1
    # fmt: on
    plant: PlantSettings = field(default_factory=PlantSettings)
    options: SceneOptions | None = None
    files: tuple[str, ...] = field(default=(), compare=False)
    own_tasks: tuple[tuple[str, Task], ...] = field(default=(), compare=False)

    @property
    def levels(self) -> Stack:  # pyright: ignore[reportIncompatibleVariableOverride]
        """The levels, highest priority first."""
        return self.stack

    @property
    def controllers(self) -> Mapping[str, str]:
        return CONTROLLERS | dict.fromkeys(self.files, "a controller of your own, in a file of this machine")

    def for_controller(self) -> ControllerSettings:
        """Returns the part of the settings for the controller. Raises InputError for an unknown
        controller."""
        if self.controller not in self.controllers:
            raise unknown_name("controller", self.controller, by_name(self.controllers))
        own = {entry.name: getattr(self, entry.name) for entry in fields(ControllerSettings)}
        own["M_bar"] = tuple(float(value) * self.M_bar_scale for value in self.M_bar)
        return ControllerSettings(**own)

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
            return replace(self, stack=moved(self.levels, event.level, event.to))
        return super().after(event)

    @classmethod
    def special(cls, table: Mapping[str, Setting], shape: Shape) -> Iterable[Setting]:
        """Besides the fields there are "stack", a list of levels as `lessons.settings.stack.read_stack` reads
        it; "order", the names of all levels, highest priority first ("a,b,c" or a list); "Q" or "R" for all
        levels (one number, or one per level); "levels.NAME.KEY" with the level's name or its place 1 … r, KEY
        one of Q, R, horizon, enabled, K_p, K_v (gains of all its tasks); "tasks.NAME.K_p|K_v". If a value has
        one number per joint, a place 1 … n after the path selects the number of that joint: "M_bar.3"."""
        controller = table["controller"]
        words = controller.form.words
        yield replace(controller, change=lambda s, name: controller.change(s, _known(words, name)))
        yield _STACK
        yield _ORDER
        yield setting_of_all_levels("Q", ("stack",), _Q)
        yield setting_of_all_levels("R", ("stack",), _R)
        names, gains = ("enabled", "Q", "R", "horizon"), ("K_p", "K_v")
        yield from settings_of_levels(shape, ("stack",), names, gains, _OF_LEVELS)

    def elements(self, path: str) -> int:
        form = self.table()[path].form
        per_joint = path.startswith(("M_bar", "nominal.", "plant.")) and form.elements is not None
        return len(self.M_bar) if per_joint else 0

    def setting(self, path: str) -> Setting:
        """As in `SceneSettings`, and also "stack.add" and the other `CHANGES`, which change a part of the
        stack, and "route", see `_with_route`."""
        return _CHANGES.get(path) or super().setting(path)

    def as_data(self) -> dict[str, Any]:
        data = super().as_data()
        return {"levels": data.pop("stack"), **data}

    def recomposed(self, wanted: TorqueSettings) -> list[tuple[str, Any]]:
        if same_tasks(self.levels, wanted.levels):
            return []
        return [("stack", stack_as_data(wanted.levels, dict(wanted.own_tasks)))]


def _with_route(settings: TorqueSettings, route: str) -> TorqueSettings:
    """Codes and scripts of earlier versions may name a route. `explicit` is now a controller. For controllers
    other than himpc, both routes had the same torques."""
    printed = route == "explicit" and settings.controller == "himpc"
    return replace(settings, controller="himpc_printed") if printed else settings


def _known(words: tuple[str, ...], name: Any) -> Any:
    if isinstance(name, str) and ".py@" in name:
        return with_fingerprint(name, words, "controller")
    if isinstance(name, str) and is_file(name) and name not in words:
        raise InputError(
            f"controller is {shortened(name, 100)}: to use a file of your own, start himpc-lab with "
            "--controller FILE.py"
        )
    return name


def _own(settings: TorqueSettings) -> Own:
    return dict(settings.own_tasks)


def _of_stack(
    path: str,
    shown: Shown,
    change: Callable[[TorqueSettings, Any], Stack],
    read: Callable[[TorqueSettings], Any] = lambda settings: settings.levels,
    shorthand: bool = True,
) -> Setting:
    """Returns a setting whose change gives a stack."""
    form = Form(None, WORD)
    return Setting(
        path, shown, form, read, lambda s, value: replace(s, stack=change(s, value)), path, shorthand
    )


_STACK = _of_stack(
    "stack",
    Shown("Stack", "The levels with their tasks, highest priority first, as a list; see himpc.tasks.KINDS"),
    lambda s, value: read_stack(value, s.levels, _own(s)),
    lambda s: stack_as_data(s.levels, _own(s)),
)
_ORDER = _of_stack(
    "order",
    Shown("Order", "The levels, highest priority first: a,b,c or a list"),
    lambda s, value: ordered(s.levels, value),
    lambda s: tuple(level.name for level in s.levels),
    shorthand=False,
)
_CHANGES = {
    path: _of_stack(path, Shown(path.removeprefix("stack."), name=path), change)
    for path, change in {
        **{path: lambda s, value, to=to: to(s.levels, value) for path, to in CHANGES.items()},
        "stack.add": lambda s, value: add(s.levels, value, _own(s)),
    }.items()
}
_ROUTES = Form(WORD, words=("compiled", "explicit", "structured"))
_CHANGES["route"] = Setting(
    "route",
    Shown("Route"),
    _ROUTES,
    lambda s: "explicit" if s.controller == "himpc_printed" else "compiled",
    lambda s, value: _with_route(s, _ROUTES.fit("route", value)),
    "route",
    shorthand=True,
)
_Q = Shown("Q", "Weight of the residual; sets all levels at once", "", 1.0, 1000.0, 1.0)
_R = Shown("R", "Weight of the changes of torque; sets all levels at once", "", 0.1, 100.0, 0.1)
_OF_LEVELS = {
    "levels.*.K_p": Shown("K_P", "Stiffness of all tasks of the level", "1/s²", 0.0, 1000.0, 1.0),
    "levels.*.K_v": Shown("K_V", "Damping of all tasks of the level", "1/s", 0.0, 100.0, 0.5),
}
