"""A controller by its name, or by the path of a file of one's own."""

from __future__ import annotations

import signal
import threading
from collections.abc import Callable
from functools import partial
from types import FrameType
from typing import Any

from himpc.controllers import Controller, make_controller
from himpc.controllers.answers import OwnFault
from himpc.controllers.own import OwnController
from lessons.own.files import Source, execute, is_file, read, sentence
from lessons.own.judge import judged
from lessons.own.kinds import law_of, line_of
from lessons.settings.torque import TorqueSettings
from robots import Robot

LONGEST_TICK = 0.5
"""s of wall time that one call may take; a control period is a millisecond or a few."""


class _TooLong(BaseException):
    """Nothing that code from outside catches by mistake."""


def controller_of(settings: TorqueSettings, robot: Robot) -> Controller:
    """The controller that settings name.

    Raises:
        InputError: unknown name, a file that is none, or settings that do not fit the robot.
    """
    wanted = settings.for_controller()
    if not is_file(settings.controller):
        return make_controller(settings.controller, robot, wanted)
    source = read(settings.controller)
    judged(source)
    module = execute(source)
    make = law_of(module)
    careful, call = partial(_guarded, source, make), partial(_guarded, source)
    return OwnController(robot, wanted, careful, call, f"{source.path}, line {line_of(module)}")


def _guarded(source: Source, function: Callable[..., Any], *args: Any) -> Any:
    """function(*args), at most LONGEST_TICK. Raises OwnFault, with the line, for whatever goes wrong."""
    watched = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    try:
        if not watched:
            return function(*args)
        before = signal.signal(signal.SIGALRM, _stop)
        signal.setitimer(signal.ITIMER_REAL, LONGEST_TICK)
        try:
            return function(*args)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)
    except _TooLong as error:
        told = sentence(source.path, error).split(": ")[0]
        raise OwnFault(f"{told}: one call takes longer than {LONGEST_TICK:g} s") from None
    except (Exception, SystemExit) as error:
        raise OwnFault(sentence(source.path, error)) from None


def _stop(_: int, __: FrameType | None) -> None:
    raise _TooLong
