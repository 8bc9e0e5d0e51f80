"""A controller by its name, or by the path of a file of one's own."""

from __future__ import annotations

import os
import signal
import threading
import time
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
from robots.isolation import waited

LONGEST_TICK = 0.5
"""s that one call may take by its own doing, asleep included; a control period is a millisecond or a few."""


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
    watch = _Watch()
    careful, call = partial(_guarded, source, watch, make), partial(_guarded, source, watch)
    return OwnController(robot, wanted, careful, call, f"{source.path}, line {line_of(module)}")


def _guarded(source: Source, watch: _Watch, function: Callable[..., Any], *args: Any) -> Any:
    """function(*args), at most LONGEST_TICK. Raises OwnFault, with the line, for whatever goes wrong."""
    watched = threading.current_thread() is threading.main_thread() and hasattr(signal, "setitimer")
    try:
        if not watched:
            return function(*args)
        watch.begin()
        before = signal.signal(signal.SIGALRM, watch.hear)
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


class _Watch:
    """Ends a call that takes too long. One that computed all the time does; one that did not may have slept
    or, on a busy machine, waited for a core, which does not count. How long it waited is asked from the first
    alarm on, since asking costs as much as a short call."""

    def __init__(self) -> None:
        self._computed = 0.0
        self._since: tuple[float, float] | None = None
        self._heard = False

    def begin(self) -> None:
        """A call begins."""
        self._computed = time.thread_time()
        self._since = (time.monotonic(), waited(os.getpid())) if self._heard else None

    def hear(self, _: int, __: FrameType | None) -> None:
        """The alarm. Raises _TooLong, or sets it again."""
        if time.thread_time() - self._computed > 0.9 * LONGEST_TICK:
            raise _TooLong
        now, starved = time.monotonic(), waited(os.getpid())
        if self._since is None:
            self._since, self._heard = (now, starved), True
        own = now - self._since[0] - (starved - self._since[1])
        if own > 0.98 * LONGEST_TICK:
            raise _TooLong
        signal.setitimer(signal.ITIMER_REAL, LONGEST_TICK - own)
