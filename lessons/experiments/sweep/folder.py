"""Stores the finished cells of a sweep in a folder; a stopped sweep continues from there.

The folder contains `sweep.json` (the definition), `cells.jsonl` (one line per finished cell, appended as it
finishes) and, at the end, `results.json` (the cells in the order of the grid).
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Callable, Iterator
from contextlib import closing, contextmanager
from dataclasses import asdict
from hashlib import sha256
from pathlib import Path
from typing import Any

from lessons.experiments.sweep.cells import Cell, perform_cell
from lessons.experiments.sweep.grid import Sweep
from lessons.outputs import write_files
from lessons.parallel import FailedJob, Spread
from robots import InputError


def usual_folder(sweep: Sweep) -> Path:
    """Returns the default folder of a sweep. Different sweeps have different folders; a repeated sweep
    continues in its folder."""
    wanted = json.dumps(sweep.as_data(), sort_keys=True)
    names = "-".join([Path(sweep.base.scene).stem, *(axis.path for axis in sweep.axes)])
    readable = re.sub(r"[^\w.-]+", "_", names, flags=re.ASCII)[:80]
    return Path("out", "sweeps", f"{readable}-{sha256(wanted.encode()).hexdigest()[:8]}")


def finished_cells(sweep: Sweep, folder: Path) -> dict[int, Cell]:
    """Returns the finished cells of the folder; creates the folder if it does not exist.

    Raises:
        InputError: the folder holds another sweep, or cannot be written.
    """
    wanted = sweep.as_data()
    try:
        folder.mkdir(parents=True, exist_ok=True)
        definition, file = folder / "sweep.json", folder / "cells.jsonl"
        if not definition.exists():
            file.write_text("")
            write_files({definition: json.dumps(wanted, indent=2) + "\n"})
        held = json.loads(definition.read_text())
        if held != wanted:
            different = ", ".join(key for key in wanted if held.get(key) != wanted[key])
            raise InputError(
                f"--out {folder} holds another sweep ({different} differ): give another folder, or repeat "
                "the command that began that sweep"
            )
        written = file.read_bytes()
        whole = written[: written.rfind(b"\n") + 1]
        if len(whole) < len(written):
            # A sweep that was stopped while writing leaves an incomplete last line; that cell is run again.
            os.truncate(file, len(whole))
        cells = [Cell(**json.loads(line)) for line in whole.splitlines()]
    except OSError as error:
        raise InputError(f"--out {folder}: cannot be used ({error.strerror}); give another folder") from None
    except (json.JSONDecodeError, TypeError, AttributeError):
        raise InputError(f"--out {folder}: its files are not those of a sweep; give another folder") from None
    return {cell.index: cell for cell in cells}


def carry_on(
    sweep: Sweep, folder: Path, spread: Spread, progress: Callable[[int, int], None] | None = None
) -> list[Cell]:
    """Runs the cells that are missing and writes `results.json`.

    Args:
        sweep: the sweep.
        folder: folder in which its cells are stored.
        spread: function that spreads the work.
        progress: called with (finished cells, all cells).

    Returns:
        all cells in the order of the grid. After an interruption, the folder contains all finished cells.

    Raises:
        InputError: see `finished_cells`; or the folder cannot be written any more; or a user's file that the
            sweep uses was changed during the sweep.
    """
    cells = finished_cells(sweep, folder)
    total, files = len(sweep.points), sweep.files()
    missing = [index for index in range(total) if index not in cells]
    if progress is not None:
        progress(len(cells), total)
    work = spread(perform_cell, [sweep.run(index) for index in missing])
    with _written(folder), (folder / "cells.jsonl").open("a") as file, closing(work) as outcomes:
        for index, outcome in outcomes:
            if sweep.files() != files:
                raise InputError(
                    f"{', '.join(files['files'])}: was changed during the sweep, and the cells before and "
                    "after this change cannot be compared: repeat the command with another folder for --out"
                )
            if isinstance(outcome, FailedJob):
                cell = Cell(missing[index], None, outcome.reason)
            else:
                cell = Cell(missing[index], outcome, None)
            file.write(json.dumps(asdict(cell), allow_nan=False) + "\n")
            file.flush()
            cells[cell.index] = cell
            if progress is not None:
                progress(len(cells), total)
    ordered = [cells[index] for index in range(total)]
    data = {**sweep.as_data(), "cells": [_as_data(sweep, cell) for cell in ordered]}
    with _written(folder):
        write_files({folder / "results.json": json.dumps(data, indent=1, allow_nan=False) + "\n"})
    return ordered


@contextmanager
def _written(folder: Path) -> Iterator[None]:
    """Raises InputError if a file of the folder cannot be written."""
    try:
        yield
    except OSError as error:
        raise InputError(
            f"--out {folder}: cannot be written ({error.strerror}); free some space, and the same command "
            "continues"
        ) from None


def _as_data(sweep: Sweep, cell: Cell) -> dict[str, Any]:
    at = dict(zip((axis.path for axis in sweep.axes), sweep.points[cell.index], strict=True))
    return {"at": at, "summary": cell.summary, "error": cell.error}
