"""The table of the arrays of a tick agrees with the code."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

import numpy as np
import pytest

import himpc.tick
from himpc.export.kernel import loop_arrays
from himpc.tick.kernel import arrays
from himpc.tick.kernel.arena import laid_out
from himpc.tick.kernel.arrays import TickArrays
from himpc.tick.tables import sizes

FOLDER = Path(next(iter(himpc.tick.__path__)))
TABLE = ("arrays", "arena", "pair_arrays")
FILES = [(path.stem, path.read_text()) for path in FOLDER.rglob("*.py") if path.stem not in TABLE]
HINTS = get_type_hints(TickArrays, include_extras=True)


def in_python(patch: pytest.MonkeyPatch, compiled: Any, sizes_of: Callable[..., Any]) -> Any:
    """Returns a function that makes views, in Python instead of compiled."""
    function = compiled.py_func
    for name, dimensions in (("vector", 1), ("matrix", 2), ("matrices", 3)):

        def view(data: np.ndarray, start: int, *shape: int, dimensions: int = dimensions) -> np.ndarray:
            assert len(shape) == dimensions
            return data[start : start + int(np.prod(shape))].reshape(shape)

        patch.setitem(function.__globals__, name, view)
    patch.setitem(function.__globals__, "sizes_of", sizes_of)
    return function


@pytest.mark.quick
def test_every_view_is_the_array_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """`arrays_of` and the arena agree on the index and the shape of every array; so do `loop_arrays_of` and
    the memory of an export."""
    arrays_of = in_python(monkeypatch, arrays.arrays_of, arrays.sizes_of)
    arena = sizes(n=7, N=5, rows=11, solved=9, levels=3, bounds=15, tasks=4, frames=2, python_rows=6)
    tick = arrays_of(*arena.arguments)
    loop_arrays_of = in_python(monkeypatch, loop_arrays.loop_arrays_of, loop_arrays.sizes_of)
    letters = loop_arrays.sizes_of(7, 5, 11, 3, 4, 15)
    loop, where, loop_views = laid_out(loop_arrays.SHAPES, letters._asdict(), float)
    loop_views["setup"][loop_arrays.LEVELS] = 3
    for found, wanted in ((tick, arena.f | arena.i), (loop_arrays_of(loop, where, tick), loop_views)):
        for name, view in found._asdict().items():
            assert view.shape == wanted[name].shape, name
            assert view.ctypes.data == wanted[name].ctypes.data, name


@pytest.mark.quick
def test_the_table_names_the_files_that_use_an_array() -> None:
    """Every array has a unit, and its annotation names exactly the files of himpc/tick that use the array."""
    for name, hint in HINTS.items():
        _, unit, files = hint.__metadata__
        used = re.compile(rf'\bt\.{name}\b|"{name}"')
        assert unit, name
        assert set(files.split()) - {"→", "itself"} == {stem for stem, text in FILES if used.search(text)}, (
            name
        )
