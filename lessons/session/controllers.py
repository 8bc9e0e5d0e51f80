"""A controller by its name, or at torque level by the path of a user's file."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, Protocol

from himpc.controllers import Controller, make_controller
from himpc.controllers.answers import OwnFault
from himpc.controllers.own import OwnController
from himpc.htmpc import HTIDKC, HTMPC, HTMPC_WPT, STMPC, HTMPCSettings, Placo, VelocityPlan
from himpc.references import Preview
from lessons.own.files import Source, is_file, read, sentence
from lessons.own.kinds import law_of, line_of
from lessons.own.load import CallDeadline, TooLong, alone, judged, load
from lessons.settings.torque import TorqueSettings
from robots import Robot
from robots.arrays import Array

LONGEST_TICK = 0.5
"""Time, s, that one call may compute or sleep; a control period is one or a few milliseconds."""


def controller_of(settings: TorqueSettings, robot: Robot) -> Controller:
    """Returns the controller that settings name.

    Raises:
        InputError: unknown name, a file without a controller, or settings that do not fit the robot.
    """
    wanted = settings.for_controller()
    if not is_file(settings.controller):
        return make_controller(settings.controller, robot, wanted)
    source = read(settings.controller)
    judged(source)
    module = load(source)
    make = law_of(module)
    watch = CallDeadline(LONGEST_TICK)
    careful, call = partial(_guarded, source, watch, make), partial(_guarded, source, watch)
    return OwnController(robot, wanted, careful, call, f"{source.path}, line {line_of(module)}")


def _guarded(source: Source, watch: CallDeadline, function: Callable[..., Any], *args: Any) -> Any:
    """Calls function(*args) for at most LONGEST_TICK. Raises OwnFault, with the line, for every exception."""
    try:
        with alone(source.path):
            return watch.call(function, *args)
    except TooLong as error:
        location = sentence(source.path, error).split(": ")[0]
        raise OwnFault(f"{location}: one call takes longer than {LONGEST_TICK:g} s") from None
    except (Exception, SystemExit) as error:
        raise OwnFault(sentence(source.path, error)) from None


class VelocityController(Protocol):
    """The methods of a controller that a velocity-level session uses."""

    @property
    def settings(self) -> HTMPCSettings:
        """The settings in use."""
        ...

    def configure(self, settings: HTMPCSettings) -> None:
        """Applies new settings at once, without a jump. Raises InputError, without any change, if they do not
        fit."""
        ...

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        """Computes one control period. It raises no exception, whatever the state, and all numbers of the
        motion are finite."""
        ...


_MAKERS: dict[str, Callable[[Robot, HTMPCSettings], VelocityController]] = {
    "htmpc": HTMPC,
    "htmpc_wpt": HTMPC_WPT,
    "stmpc": STMPC,
    "htidkc": HTIDKC,
    "placo": Placo,
}


def make_velocity_controller(name: str, robot: Robot, settings: HTMPCSettings) -> VelocityController:
    """Returns a controller by its name. Raises InputError for settings that do not fit the robot."""
    return _MAKERS[name](robot, settings)
