"""The tool chain that uses Numba's documented interface only; see the package."""

from __future__ import annotations

import linecache
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numba
from numba import njit

from himpc.compilation import OPTIONS, SWITCH, Function
from himpc.compilation.sources import digest_of
from robots.errors import InputError

config: Any = numba.config  # pyright: ignore[reportPrivateImportUsage]
inline_kernel = njit(**OPTIONS)
always_inline_kernel = njit(**OPTIONS, forceinline=True)
"""See `compiled`."""


def kernel(*arguments: Any) -> Callable[[Function], Any]:
    """See `compiled`."""

    def compile_now(function: Function) -> Any:
        # Numba's cache checks the function's own file only; the name of the folder contains the digest of all
        # other files.
        cache_dir: str = config.CACHE_DIR
        kept = (
            Path(cache_dir)
            if cache_dir
            else Path(function.__code__.co_filename).parent / "__pycache__" / "public"
        )
        config.CACHE_DIR = str(kept / digest_of(function).hex()[:16])
        try:
            return njit(arguments, cache=True, **OPTIONS)(function)
        finally:
            config.CACHE_DIR = cache_dir

    return compile_now


@contextmanager
def on_compiled(tell: Callable[[str], None]) -> Iterator[None]:
    """See `compiled`; in this tool chain `tell` is never called."""
    yield


@inline_kernel
def vector(data: Any, start: int, n: int) -> Any:
    """See `views`."""
    return data[start : start + n]


@inline_kernel
def matrix(data: Any, start: int, rows: int, columns: int) -> Any:
    """See `views`."""
    return data[start : start + rows * columns].reshape((rows, columns))


@inline_kernel
def matrices(data: Any, start: int, count: int, rows: int, columns: int) -> Any:
    """See `views`."""
    return data[start : start + count * rows * columns].reshape((count, rows, columns))


@inline_kernel
def borrowed(array: Any) -> Any:
    """See `views`."""
    return array


def arrays_in(table: type, numbers: dict[str, str], wholes: dict[str, str]) -> Any:
    """See `views`."""
    text = f"""
def arrays(data, where, whole, whole_where, s):
    return {table.__name__}({_views("data", "where", numbers)}{_views("whole", "whole_where", wholes)})
"""
    file = f"<{table.__module__}.{table.__name__}>"  # tracebacks and debuggers show the text
    linecache.cache[file] = len(text), None, text.splitlines(True), file
    scope = {"vector": vector, "matrix": matrix, "matrices": matrices}
    scope |= {"__name__": table.__module__, table.__name__: table}
    exec(compile(text, file, "exec"), scope)
    return inline_kernel(scope["arrays"])


def _views(memory: str, where: str, shapes: dict[str, str]) -> str:
    """Returns the text of the views of all arrays in a memory: "matrix(data, where[3], s.N, 4), ..."."""
    text = ""
    for index, shape in enumerate(shapes.values()):
        sizes = [size if size.isdecimal() else f"s.{size}" for size in shape.split()]
        view = ("vector", "matrix", "matrices")[len(sizes) - 1]
        text += f"{view}({memory}, {where}[{index}], {', '.join(sizes)}), "
    return text


def intermediate(function: Function, arguments: tuple[Any, ...]) -> tuple[str, list[str]]:
    """See `compiled`; this tool chain cannot return LLVM code.

    Raises:
        InputError: always.
    """
    raise InputError(f"export needs the usual tool chain: unset {SWITCH}")


def kept(function: Function, key: str, make: Callable[[], bytes]) -> bytes:
    """See `compiled`; this tool chain stores nothing."""
    return make()
