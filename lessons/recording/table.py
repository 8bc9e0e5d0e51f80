"""Recorded rows as named arrays and as a table for a spreadsheet."""

from __future__ import annotations

import io
import json
from typing import Any

import numpy as np
from numpy.typing import NDArray

from himpc.telemetry import Layout
from lessons.settings.settings import Settings
from lessons.settings.values import finite

Array = NDArray[np.float64]


def named(layout: Layout, rows: Array, settings: Settings, how: dict[str, Any]) -> dict[str, Any]:
    """Every field of telemetry by its name, and what the run was.

    Args:
        layout: of the rows.
        rows: (k, size).
        settings: in force at the end.
        how: anything else that is worth telling.

    Returns:
        (k,) or (k, width) per field of the layout, with the names and units of `himpc-lab run --npz`;
        `joint_names`; `settings`, a JSON text.
    """
    data: dict[str, Any] = {name: rows[:, where] for name, where in layout.fields.items()}
    data = {name: found[:, 0] if found.shape[1] == 1 else found for name, found in data.items()}
    data["joint_names"] = np.array(layout.joints)
    told = {**how, "in_force": settings.as_data()}
    data["settings"] = np.array(json.dumps(finite(told)))
    return data


def as_npz(data: dict[str, Any]) -> bytes:
    """Arrays as the bytes of a compressed .npz file."""
    memory = io.BytesIO()
    np.savez_compressed(memory, **data)
    return memory.getvalue()


def as_csv(layout: Layout, rows: Array) -> bytes:
    """One line per row, one column per number: the field's name and, where it has several, which one. SI
    units; orientations are quaternions x y z w. An empty cell is a number that is not defined."""
    heads: list[str] = []
    for name, where in layout.fields.items():
        width = where.stop - where.start
        heads += [name] if width == 1 else [f"{name}[{which}]" for which in _words(layout, name, width)]
    lines = [",".join(heads)]
    lines += [",".join("" if cell != cell else f"{cell:.9g}" for cell in row) for row in rows.tolist()]
    return ("\n".join(lines) + "\n").encode()


def _words(layout: Layout, field: str, width: int) -> tuple[str, ...]:
    """Names of a field's numbers."""
    kind, _, name = field.partition("/")
    if not name:
        return layout.joints
    task = next(task for task in layout.tasks if task.name == name)
    if width == len(task.coordinates) and not (kind in ("x", "x_d") and width == 4):
        return task.coordinates
    return ("x", "y", "z", "w")[:width]
