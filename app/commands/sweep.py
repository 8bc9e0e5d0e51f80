"""`himpc-lab sweep`."""

from __future__ import annotations

import sys
from contextlib import nullcontext
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import tyro

from app.commands.output import figure, progress_bar, readable_unit

if TYPE_CHECKING:
    from lessons.experiments.sweep import Cell, Sweep


def sweep(
    scene: tyro.conf.Positional[str],
    out: Path | None = None,
    over: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=lo:hi:n")] = (),
    controller: str | None = None,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    duration: float | None = None,
    seed: int = 0,
    metric: str | None = None,
    scheduler: str | None = None,
) -> int:
    """Run a grid of settings of a scene on all cores and draw it as a map.

    Ctrl-C stops the sweep; the same command continues it later. Runs that fail or lose control are marked in
    the map.

    Args:
        scene: name of a scene (see himpc-lab scenes), or a Python file of your own.
        out: folder for cells.jsonl, results.json and map.png; by default a folder in out/sweeps, named after
            the scene, the settings and a hash of the whole sweep.
        over: a setting and its range, e.g. --over M_bar_scale=0.2:4:20 --over horizon=1:20:20. Ranges of a
            decade and more have logarithmic steps; PATH=lo:hi:n:lin or PATH=lo:hi:n:log sets the kind of
            steps.
        controller: name of a controller (see himpc-lab controllers) or a Python file of your own; the scene's
            own by default.
        set: change a setting in all runs, e.g. --set plant.payload_kg=2.
        duration: simulated seconds per run; the scene's own by default.
        seed: seed of the runs, from 0 to 2⁶³ − 1.
        metric: quantity that the map shows; the RMSE of level 1 after the first second by default.
        scheduler: address of a Dask scheduler, e.g. tcp://10.0.0.1:8786, instead of this machine's cores.
    """
    from lessons.cluster import on_cluster
    from lessons.experiments.sweep import (
        carry_on,
        check_metric,
        finished_cells,
        make_sweep,
        metrics,
        usual_folder,
    )
    from lessons.parallel import on_cores
    from lessons.scenes.run_spec import RunSpec

    base = RunSpec(scene, controller=controller, duration=duration, seed=seed).admitting(*set)
    definition = make_sweep(base, over)
    choices = metrics(definition)
    shown = check_metric(metric or choices[0], choices)
    if out is None:
        out = usual_folder(definition)
    held = len(finished_cells(definition, out))
    total = len(definition.points)
    way = nullcontext(on_cores) if scheduler is None else on_cluster(scheduler)
    print(f"{total} cells, {held} of them already in {out}", file=sys.stderr)
    try:
        with way as spread, progress_bar(f"sweep {scene} …") as advance:
            cells = carry_on(definition, out, spread, lambda done, all: advance(done / all))
    except KeyboardInterrupt:
        done = len(finished_cells(definition, out))
        print(f"himpc-lab: stopped with {done} of {total} cells; the same command continues", file=sys.stderr)
        raise
    _conclude(definition, cells, shown, out)
    return 0


def _conclude(definition: Sweep, cells: list[Cell], metric: str, out: Path) -> None:
    from lessons.experiments.sweep import best_cell, draw_sweep, unit_of

    picture = draw_sweep(definition, cells, metric, out)
    lost = sum(cell.diverged for cell in cells)
    failed = sum(cell.error is not None for cell in cells)
    print(f"{len(cells)} cells: {lost} lost control, {failed} could not be run")
    best = best_cell(cells, metric)
    if best is not None:
        point = zip(definition.axes, definition.points[best.index], strict=True)
        at = ", ".join(f"{axis.path} = {value:g}" for axis, value in point)
        unit = unit_of(cells, metric)
        number = figure(best.value(metric)) if not unit else " ".join(readable_unit(best.value(metric), unit))
        print(f"smallest {metric}: {number} at {at}")
    first = next((cell.error for cell in cells if cell.error), None)
    if first:
        print(f"first failure: {first}")
    print(f"results: {out / 'results.json'}" + (f", picture: {picture}" if picture else ""))
