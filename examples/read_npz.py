"""Reading a recording: the arrays of `himpc-lab run SCENE --npz FILE`, read with NumPy alone.

    python examples/read_npz.py [FILE.npz]

Without a file, the program first makes a short run and writes it, as the command line does. Prints the scene
and controller, then per task its level and its RMS error per coordinate, then per joint how much of its
torque limit the run needed.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np

from app.__main__ import main as himpc_lab


def main(seconds: float = 2.0, file: Path | None = None) -> None:
    """Prints the results that the module describes."""
    if file is None:
        file = Path("run.npz")
        himpc_lab(
            ["run", "iiwa14-circle", "--duration", str(seconds), "--npz", str(file), "--json", "run.json"]
        )
    data = np.load(file)

    # `settings` is a JSON text that reproduces the run: scene, controller, seed, assignments, events.
    told = json.loads(str(data["settings"]))
    print(f"run: {told['scene']} under {told['controller']}, {len(data['t'])} ticks of telemetry")

    tasks = [name.removeprefix("error/") for name in data.files if name.startswith("error/")]
    for task in tasks:
        rms = np.sqrt((data[f"error/{task}"] ** 2).mean(axis=0))
        level = int(np.atleast_1d(data[f"level/{task}"])[0])
        print(f"task {task}: level {level}, RMS {', '.join(f'{value:.3g}' for value in rms)} m or rad")

    share = np.abs(data["tau"]) / data["tau_upper"]
    for name, most in zip(data["joint_names"], share.max(axis=0), strict=True):
        print(f"joint {name}: {100 * most:.1f} % of its torque limit")


if __name__ == "__main__":
    main(file=Path(sys.argv[1]) if len(sys.argv) > 1 else None)
