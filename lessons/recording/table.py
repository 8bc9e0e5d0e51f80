"""Recorded rows as files: compressed arrays, and a table for a spreadsheet."""

from __future__ import annotations

import io
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import Layout

Array = NDArray[np.float64]


def as_npz(data: dict[str, Any]) -> bytes:
    """Arrays as the bytes of a compressed .npz file."""
    memory = io.BytesIO()
    np.savez_compressed(memory, **data)
    return memory.getvalue()


def as_csv(layout: Layout, rows: Array) -> bytes:
    """Returns one line per row, one column per number. The heading is the field's name; if the field has
    several numbers, the number's name follows in brackets. SI units; orientations are quaternions x y z w. An
    empty cell stands for a number that is not defined."""
    heads: list[str] = []
    for name, where in layout.fields.items():
        width = where.stop - where.start
        heads += [name] if width == 1 else [f"{name}[{which}]" for which in _words(layout, name, width)]
    lines = [",".join(heads)]
    lines += [",".join("" if cell != cell else f"{cell:.9g}" for cell in row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _words(layout: Layout, field: str, width: int) -> tuple[str, ...]:
    """Returns names of a field's numbers."""
    kind, _, name = field.partition("/")
    if not name:
        return layout.joints
    task = next(task for task in layout.tasks if task.name == name)
    if width == len(task.coordinates) and not (kind in ("x", "x_d") and width == 4):
        return task.coordinates
    return ("x", "y", "z", "w")[:width]
