"""Loads a user's file within limits: a deadline, no other processes, no signals. If the file replaces
something in a library, the original is restored.
"""

from __future__ import annotations

import ctypes
import math
import signal
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from functools import cache
from types import ModuleType
from typing import Any

from lessons.own.deadline import TooLong, within
from lessons.own.files import Source, execute
from robots import InputError

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
