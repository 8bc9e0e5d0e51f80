"""A sweep in Python: a grid of runs on all cores, stored in a folder, and continued after an interruption.

The grid is payload × horizon. Prints how many cells there are, the error of each, and the best one; the
folder `sweep-out` contains cells.jsonl, results.json and map.png. A second run of this program computes no
cell again.
"""

from __future__ import annotations

from pathlib import Path

from lessons import RunSpec
from lessons.experiments.sweep import best_cell, carry_on, draw_sweep, make_sweep, metrics
from lessons.parallel import Spread, on_cores


def main(seconds: float = 1.0, spread: Spread = on_cores) -> None:
    """Prints the results that the module describes. spread: distributes the runs over processes; see
    `lessons.parallel`."""
    base = RunSpec("iiwa14-circle", duration=seconds)
    sweep = make_sweep(base, ("plant.payload_kg=0:4:2", "horizon=2:6:2"))
    print(f"cells: {len(sweep.points)}")

    # The first metric is the default one: the RMS error of level 1.
    metric = metrics(sweep)[0]
    folder = Path("sweep-out")
    cells = carry_on(sweep, folder, spread)
    for cell, point in zip(cells, sweep.points, strict=True):
        at = ", ".join(f"{axis.path} = {value:g}" for axis, value in zip(sweep.axes, point, strict=True))
        print(f"cell {at}: {metric} {cell.value(metric):.3g}")

    best = best_cell(cells, metric)
    if best is not None:
        print(f"best: cell {best.index}")
    draw_sweep(sweep, cells, metric, folder)


if __name__ == "__main__":
    main()
