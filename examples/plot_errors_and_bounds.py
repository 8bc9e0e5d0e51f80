"""A plot of a run: errors per task, and torques, velocities and positions inside their bounds.

Writes `circle.png`, the page's picture, by one call, and `by-hand.png`, which shows how to plot other curves.
Prints the names of the files and the largest share of a torque bound.
"""

from __future__ import annotations

from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np

from lessons import load_scene, prepared, run
from lessons.plots.draw import draw
from lessons.plots.recorded import Recorded, run_picture


def main(seconds: float = 4.0) -> None:
    """Prints the results that the module describes."""
    recording = run(prepared(load_scene("iiwa14-circle"), "himpc", ()), seconds)

    picture = run_picture("circle", Recorded(recording.layout, recording.rows), None, 1e-3)
    draw(picture, Path("."))
    print("picture: circle.png")

    # Every field of telemetry is an array over time: recording["tau"] is (ticks, n).
    t = recording["t"][:, 0]
    share = recording["tau"] / recording["tau_upper"]
    figure, (above, below) = plt.subplots(2, 1, sharex=True, figsize=(7, 5), layout="constrained")
    above.semilogy(t, 1e3 * np.linalg.norm(recording["error/position"], axis=1) + 1e-6)
    above.set_ylabel("error of level 1 (mm)")
    below.plot(t, 100 * share)
    below.axhline(100, color="black")
    below.axhline(-100, color="black")
    below.set_ylabel("torque (% of bound)")
    below.set_xlabel("time (s)")
    figure.savefig("by-hand.png", dpi=150)
    plt.close(figure)
    print("picture: by-hand.png")
    print(f"largest torque: {100 * np.abs(share).max():.1f} % of its bound")


if __name__ == "__main__":
    main()
