"""The table of the arrays of a tick agrees with the code."""

from __future__ import annotations

import re
from importlib import import_module
from pathlib import Path
from typing import get_type_hints

import numpy as np
import pytest

import himpc.tick
from himpc.export.kernel import loop_arrays
from himpc.tick.kernel.arena import laid_out
from himpc.tick.kernel.arrays import TickArrays
from himpc.tick.tables import sizes

FOLDER = Path(next(iter(himpc.tick.__path__)))
TABLE = ("arrays", "arena", "pair_arrays")
FILES = [(path.stem, path.read_text()) for path in FOLDER.rglob("*.py") if path.stem not in TABLE]
HINTS = get_type_hints(TickArrays, include_extras=True)


LOOK = """
from himpc.compilation.compiled import INDICES, TABLE, VECTOR, kernel
from himpc.export.kernel.loop_arrays import loop_arrays_of
from himpc.tick.kernel.arrays import arrays_of

@kernel(VECTOR, INDICES, INDICES, INDICES, VECTOR, INDICES, TABLE)
def look(data, where, whole, whole_where, loop, loop_where, out):
    t = arrays_of(data, where, whole, whole_where)
    p = loop_arrays_of(loop, loop_where, t)
"""


@pytest.mark.quick
def test_every_view_is_the_array_of_its_name(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """`arrays_of` and the arena agree on the address and the shape of every array; so do `loop_arrays_of` and
    the memory of an export."""
    arena = sizes(n=7, N=5, rows=11, solved=9, levels=3, bounds=15, tasks=4, frames=2, python_rows=6)
    letters = loop_arrays.sizes_of(7, 5, 11, 3, 4, 15)
    loop, where, loop_views = laid_out(loop_arrays.SHAPES, letters._asdict(), float)
    loop_views["setup"][loop_arrays.LEVELS] = 3
    wanted = [(f"t.{name}", array) for name, array in (arena.f | arena.i).items()]
    wanted += [(f"p.{name}", array) for name, array in loop_views.items()]
    text = LOOK
    for index, (name, array) in enumerate(wanted):
        text += f"    out[{index}, 0] = {name}.ctypes.data\n"
        for d in range(array.ndim):
            text += f"    out[{index}, {1 + d}] = {name}.shape[{d}]\n"
    (tmp_path / "look_at_views.py").write_text(text)
    monkeypatch.syspath_prepend(tmp_path)
    found = np.zeros((len(wanted), 4), np.int64)
    import_module("look_at_views").look(*arena.arguments, loop, where, found)
    for (name, array), (address, *shape) in zip(wanted, found.tolist(), strict=True):
        assert tuple(shape[: array.ndim]) == array.shape, name
        assert address == array.ctypes.data, name


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
