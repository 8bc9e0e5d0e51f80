"""The table of the arrays of a tick agrees with the code."""

from __future__ import annotations

import re
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

import himpc.tick
from himpc.tick.kernel import arrays_of
from himpc.tick.kernel.arrays import NUMBERS, TickArrays
from himpc.tick.tables import sizes

FOLDER = Path(next(iter(himpc.tick.__path__)))
TABLE = ("arrays", "arrays_of", "arena")
FILES = [(path.stem, path.read_text()) for path in FOLDER.rglob("*.py") if path.stem not in TABLE]
HINTS = get_type_hints(TickArrays, include_extras=True)


@pytest.mark.quick
def test_every_view_is_the_array_of_its_name(monkeypatch: pytest.MonkeyPatch) -> None:
    """`arrays_of` and the arena agree on the index and the shape of every array."""
    for name, dimensions in (("vector", 1), ("matrix", 2), ("matrices", 3)):

        def view(data: np.ndarray, start: int, *shape: int, dimensions: int = dimensions) -> np.ndarray:
            assert len(shape) == dimensions
            return data[start : start + int(np.prod(shape))].reshape(shape)

        monkeypatch.setattr(arrays_of, name, view)
    arena = sizes(n=7, N=5, rows=11, solved=9, levels=3, bounds=15, tasks=4, frames=2, given=6)
    for name, found in arrays_of.arrays_of.py_func(*arena.arguments)._asdict().items():
        wanted = arena.f[name] if name in NUMBERS else arena.i[name]
        assert found.shape == wanted.shape, name
        assert found.ctypes.data == wanted.ctypes.data, name


@pytest.mark.quick
def test_the_table_names_the_files_that_use_an_array() -> None:
    """Every array has a unit, and its annotation names exactly the files of himpc/tick that use the array."""
    for name, hint in HINTS.items():
        _, unit, files = hint.__metadata__
        used = re.compile(rf'\bt\.{name}\b|AT\.{name}\b|"{name}"')
        assert unit, name
        assert set(files.split()) - {"→", "itself"} == {stem for stem, text in FILES if used.search(text)}, (
            name
        )
