"""Loads compiled functions from disk when their module is first imported. Functions that are not on disk are
first compiled in a separate process, see `compiler`.

When a function is requested, Numba first prepares its compiler: it reads Numba's definitions of NumPy's
functions, and imports SciPy. This preparation takes a third of a second in every process. It is not needed if
the machine code is on disk.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from logging import getLogger
from pathlib import Path
from typing import Any

import numpy.ma  # noqa: F401  (Numba imports it at the first call with an array, which would be a robot's first tick)
from numba import njit
from numba.core import event
from numba.core.compiler_lock import global_compiler_lock
from numba.core.registry import CPUDispatcher
from numba.core.runtime.nrt import rtsys

from himpc.compilation import OPTIONS, Function
from himpc.compilation.compiler import compile_apart, compiles_here
from himpc.compilation.keeping import Kept
from himpc.compilation.pieces import LinkedCompiler, Open, Piece
from himpc.compilation.sources import digest_of


def load(function: Any, arguments: tuple[Any, ...]) -> bool:
    """Loads the machine code of a function for arguments of these types, and returns whether it was on
    disk."""
    with global_compiler_lock:
        rtsys.initialize(function.targetctx)  # functions that the machine code calls
        overload = function._cache.load_overload(arguments, function.targetctx)
        if overload is None:
            return False
        function._cache_hits[arguments] += 1
        function.targetctx.insert_user_function(overload.entry_point, overload.fndesc, [overload.library])
        function.add_overload(overload)
        return True


try:
    import fcntl
except ImportError:  # on a system without fcntl, two processes may compile the same function
    fcntl = None

_OPTIONS: dict[str, Any] = {**OPTIONS, "no_cfunc_wrapper": True}
_PIECE = {**_OPTIONS, "no_cpython_wrapper": True, "pipeline_class": Piece}
_OPEN = {**_OPTIONS, "no_cpython_wrapper": True, "_nrt": False, "pipeline_class": Open}
"""Options for functions that allocate nothing and need no reference counts."""


class _Inline(CPUDispatcher):
    """A function that only compiled functions can call. It has no address of its own, and a call from Python
    raises TypeError, also after the function was compiled as a part of another function."""

    def __call__(self, *_: Any, **__: Any) -> Any:  # pyright: ignore[reportIncompatibleMethodOverride]
        name = self.py_func.__qualname__
        raise TypeError(f"{name} can be called by compiled functions only")


def inline_kernel(function: Function) -> Any:
    """See `compiled`."""
    return _as_inline(njit(**_PIECE)(function))


def always_inline_kernel(function: Function) -> Any:
    """See `compiled`."""
    return _as_inline(njit(**_PIECE, forceinline=True)(function))


def _as_inline(function: Any) -> Any:
    function.__class__ = _Inline
    return function


def kernel(*arguments: Any) -> Callable[[Function], Any]:
    """Compiles a function, with every `inline_kernel` that it calls, for arguments of these types only.

    Compilation at the first call would stop a running robot for several seconds at each new layout of an
    array.

    A file on disk is valid until a source file of the function changes, see `sources`.
    """

    def compile_now(function: Function) -> Any:
        fast: Any = njit(**_OPTIONS, pipeline_class=LinkedCompiler)(function)
        fast._cache = Kept(Path(function.__code__.co_filename), function.__qualname__, digest_of(function))
        return _compiled_now(fast, arguments)

    return compile_now


def _compiled_now(fast: Any, arguments: tuple[Any, ...]) -> Any:
    module = fast.py_func.__module__
    loaded = load(fast, arguments)
    if not loaded:
        cache_path = fast.stats.cache_path
        if not compiles_here() and module != "__main__" and fast._cache.has_room():
            _FIRST_WORD.say()
            with _one_at_a_time(cache_path, "waiting"):
                loaded = load(fast, arguments)  # another process may have compiled it meanwhile
                if not loaded:
                    compile_apart(module, lambda name: event.end_event(_APART, name))
                    loaded = load(fast, arguments)
        if not loaded:
            with _one_at_a_time(cache_path, f"compiling-{module}"):
                if not load(fast, arguments):  # another process may have compiled it meanwhile
                    fast.compile(arguments)
    fast.disable_compile()
    return fast


def intermediate(function: Function, arguments: tuple[Any, ...]) -> tuple[str, list[str]]:
    """Returns a function and all functions that it calls as LLVM code in text form, which is not optimised
    for any processor.

    Args:
        function: a Python function whose callees are inline kernels.
        arguments: types of its arguments.

    Returns:
        the name of the function in the LLVM code, and the code of each module.
    """
    fast: Any = njit(**_OPEN)(function)
    fast.compile(arguments)
    (overload,) = fast.overloads.values()
    modules = [
        str(library._get_module_for_linking()) for library in (overload.library, *overload.library.called)
    ]
    return overload.fndesc.llvm_func_name, modules


def kept(function: Function, key: str, make: Callable[[], bytes]) -> bytes:
    """Returns bytes that depend on the sources of a function. They are read from disk, or made and stored if
    the file is missing.

    Args:
        function: a Python function.
        key: name of the kind of bytes; it becomes part of the file's name.
        make: makes the bytes.
    """
    store = Kept(Path(function.__code__.co_filename), function.__qualname__, digest_of(function))
    data = store.load_bytes(key)
    if data is None:
        with _one_at_a_time(store.cache_path, key):
            data = store.load_bytes(key)  # another process may have made them meanwhile
            if data is None:
                data = make()
                store.save_bytes(key, data)
    return data


@contextmanager
def _one_at_a_time(folder: str | None, what: str) -> Iterator[None]:
    """Holds a lock while code is made. If several processes need the same code, the first one makes it. The
    others wait, and then find the code on disk."""
    lock = None
    if fcntl is not None and folder is not None:
        with suppress(OSError):  # for example a full disk
            lock = os.open(Path(folder, f"himpc-lab-{what}.lock"), os.O_WRONLY | os.O_CREAT, 0o600)
            fcntl.flock(lock, fcntl.LOCK_EX)
    try:
        yield
    finally:
        if lock is not None:
            os.close(lock)


class _FirstWord(event.Listener):
    """Writes one line to the log when compilation begins, so that a user at a terminal sees the reason for
    the wait."""

    def __init__(self) -> None:
        self._said = compiles_here()  # a compiling process writes no line: its parent already did

    def say(self) -> None:
        """Writes the line, unless it was already written."""
        if not self._said:
            self._said = True
            getLogger(__name__).warning(
                "compiling the controller's inner loops once: this takes about half a minute"
            )

    def on_start(self, event: Any) -> None:
        self.say()

    def on_end(self, event: Any) -> None:
        """Does nothing: the line is written at the start."""


_FIRST_WORD = _FirstWord()
event.register("numba:compile", _FIRST_WORD)


_APART = "himpc-lab:compiled-apart"


class _Compiled(event.Listener):
    def __init__(self, tell: Callable[[str], None]) -> None:
        self._tell = tell

    def on_start(self, event: Any) -> None:
        """Does nothing: a function is reported at the end of its compilation."""

    def on_end(self, event: Any) -> None:
        if event.kind == _APART:
            self._tell(event.data)
        elif tuple(event.data["args"]) in event.data["dispatcher"].overloads:
            function = event.data["dispatcher"].py_func
            self._tell(f"{function.__module__}.{function.__qualname__}")


@contextmanager
def on_compiled(tell: Callable[[str], None]) -> Iterator[None]:
    """Returns a context manager. In its context, `tell` is called with the dotted name of every function that
    is compiled."""
    heard = _Compiled(tell)
    with event.install_listener("numba:compile", heard), event.install_listener(_APART, heard):
        yield
