"""Loads a user's file within limits: a deadline, no other processes, no signals. If the file replaces
something in a library, the original is restored. `judged` loads a file first in a separate process, where it
can do no harm, and `CallDeadline` ends calls of its functions that take too long.
"""

from __future__ import annotations

import ctypes
import math
import os
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache, lru_cache
from types import FrameType, ModuleType
from typing import Any, ParamSpec, TypeVar, final

from lessons.own.files import Source, execute
from lessons.own.kinds import Kind, kind_of
from robots import InputError
from robots.processes.isolation import Allowance, Fault, isolated, waited

_P = ParamSpec("_P")
_T = TypeVar("_T")


class TooLong(BaseException):
    """Is raised to end a call. It is a BaseException, which user code does not catch by mistake."""


def within(seconds: float, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
    """Returns function(…). Raises TooLong if the call takes longer than `seconds`."""
    return CallDeadline(seconds).call(function, *args, **kwargs)


@final
class CallDeadline:
    """Ends calls that take too long, in the main thread of a POSIX system. Computing and sleeping count;
    waiting for a core on a busy machine does not. The waiting time is read only after the first alarm, since
    reading it takes as long as a short call.
    """

    def __init__(self, seconds: float) -> None:
        self._seconds = seconds
        self._computed = 0.0
        self._since: tuple[float, float] | None = None
        self._heard = False

    def call(self, function: Callable[_P, _T], *args: _P.args, **kwargs: _P.kwargs) -> _T:
        """Returns function(…). Raises TooLong if the call takes too long."""
        if threading.current_thread() is not threading.main_thread() or not hasattr(signal, "setitimer"):
            return function(*args, **kwargs)
        self._begin()
        before = signal.signal(signal.SIGALRM, self._hear)
        signal.setitimer(signal.ITIMER_REAL, self._seconds)
        try:
            return function(*args, **kwargs)
        finally:
            signal.setitimer(signal.ITIMER_REAL, 0.0)
            signal.signal(signal.SIGALRM, before)

    def _begin(self) -> None:
        """Starts the measurement of a call's time."""
        self._computed = time.thread_time()
        self._since = (time.monotonic(), waited(os.getpid())) if self._heard else None

    def _hear(self, _: int, __: FrameType | None) -> None:
        """Handles the alarm: raises TooLong, or sets the alarm again."""
        if time.thread_time() - self._computed > 0.9 * self._seconds:
            raise TooLong
        now, starved = time.monotonic(), waited(os.getpid())
        if self._since is None:
            self._since, self._heard = (now, starved), True
        own = now - self._since[0] - (starved - self._since[1])
        if own > 0.98 * self._seconds:
            raise TooLong
        signal.setitimer(signal.ITIMER_REAL, self._seconds - own)


LONGEST = 10.0
"""Time, s, that loading a file may take, without the time that it waits for a core."""
_REFUSED = ("os.fork", "os.forkpty", "os.kill", "os.killpg", "os.exec", "os.posix_spawn", "os.system",
            "os.spawn", "pty.spawn", "signal.pthread_kill")  # fmt: skip
_BY_ITSELF = ("subprocess.Popen",)
"""Calls that an installed package may make during its import, but that a user's file may not make."""
_SHARED = ("builtins", "math", "numpy", "scipy", "pinocchio", "os", "time", "himpc", "robots", "lessons")
_running: ContextVar[str] = ContextVar("_running", default="")


@contextmanager
def alone(path: str) -> Iterator[None]:
    """Within this context, code in this thread that starts or signals a process raises PermissionError."""
    _watched()
    token = _running.set(path)
    try:
        yield
    finally:
        _running.reset(token)


@cache
def _watched() -> None:
    """Installs one audit hook, which cannot be removed; it acts only while code runs within `alone`."""
    sys.addaudithook(_hook)


def _hook(event: str, _: Sequence[Any]) -> None:
    if event not in _REFUSED and event not in _BY_ITSELF:
        return
    path = _running.get()
    if path and (event in _REFUSED or _caller() == path):
        raise PermissionError(f"your own file must not start or signal a process ({event}): leave that out")


def _caller() -> str:
    """Returns the path of the file whose code starts a process."""
    frame = sys._getframe(2)
    while frame.f_back is not None and frame.f_code.co_filename == sys.modules["subprocess"].__file__:
        frame = frame.f_back
    return frame.f_code.co_filename


def load(source: Source, seconds: float = LONGEST) -> ModuleType:
    """Returns the module that a file defines.

    Raises:
        InputError: the file cannot be executed (the message names the line), computes or sleeps for more than
            `seconds`, starts or signals a process, or replaces an object that the lab uses, too.
    """
    before, handlers = _shared(), _handlers()
    try:
        with alone(source.path):
            return _in_time(source, seconds)
    except KeyboardInterrupt:
        raise InputError(f"{source.path}: loading it interrupts the program: leave that out") from None
    finally:
        _put_back(handlers)
        replaced = _restored(before)
        if replaced:
            sys.modules.pop(source.module, None)
            raise InputError(
                f"{source.path}: loading it replaces {replaced[0]}, which the lab uses, too: leave that out"
            )


def _in_time(source: Source, seconds: float) -> ModuleType:
    if seconds == math.inf:
        return execute(source)
    late = InputError(f"{source.path}: loading it takes longer than {seconds:g} s; give a simpler one")
    if threading.current_thread() is threading.main_thread():
        try:
            return within(seconds, execute, source)
        except TooLong:
            raise late from None
    done: list[ModuleType | BaseException] = []

    def work() -> None:
        try:
            with alone(source.path):
                done.append(execute(source))
        except BaseException as error:
            done.append(error)

    thread = threading.Thread(target=work, daemon=True)
    thread.start()
    thread.join(seconds)
    if not done:
        # Code that computes ends at once; code that sleeps in a library ends when it wakes.
        here = ctypes.c_ulong(thread.ident or 0)
        ctypes.pythonapi.PyThreadState_SetAsyncExc(here, ctypes.py_object(TooLong))
        raise late
    if isinstance(done[0], BaseException):
        raise done[0]
    return done[0]


# ---------------------------------------------------------------- replaced objects


def _shared() -> dict[str, dict[str, Any]]:
    """Returns the functions, classes and modules in the modules of the lab and of its libraries."""
    return {
        name: {key: value for key, value in vars(module).items() if _is_code(value)}
        for name, module in list(sys.modules.items())
        if isinstance(module, ModuleType) and name.partition(".")[0] in _SHARED
    }


def _is_code(value: Any) -> bool:
    return callable(value) or isinstance(value, ModuleType)


def _restored(before: dict[str, dict[str, Any]]) -> list[str]:
    """Restores the objects that were replaced, and returns their names."""
    restored = []
    for name, names in before.items():
        module = sys.modules.get(name)
        if module is None:
            continue
        now = vars(module)
        for key, value in names.items():
            if now.get(key) is not value:
                now[key] = value
                restored.append(f"{name}.{key}")
    return restored


def _handlers() -> dict[int, Any]:
    if threading.current_thread() is not threading.main_thread():
        return {}
    return {number: signal.getsignal(number) for number in signal.valid_signals()}


def _put_back(handlers: dict[int, Any]) -> None:
    get: Callable[[int], Any] = signal.getsignal
    for number, handler in handlers.items():
        if handler is not None and get(number) is not handler:
            signal.signal(number, handler)


LOADING = Allowance(10.0, 2_000_000_000, "loading it", "ends the program", "leave that out")
"""Limits for loading a file before it is known to be harmless."""


@lru_cache(maxsize=64)
def judged(source: Source) -> Kind:
    """Returns the kind of a file. Raises InputError, with one sentence, if it cannot be loaded within the
    limits."""
    try:
        return isolated(_kind, source, within=LOADING, copied=True)
    except Fault as fault:
        raise InputError(f"{source.path}: {fault}") from None


def _kind(source: Source) -> Kind:
    return kind_of(load(source, math.inf))
