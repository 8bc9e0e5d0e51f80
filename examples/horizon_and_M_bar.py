"""Setting N and M̄ by hand: cost and benefit of the horizon, and which diagonal M̄ is too large.

M̄ replaces the robot's mass matrix M. Time-delay estimation multiplies its error by I − M⁻¹M̄ from tick to
tick, so the spectral radius of that matrix has to stay below 1. A smaller M̄ keeps it below 1, but makes
control less accurate. Prints a line per N and a line per factor on M̄: the RMS error of level 1 after the
first quarter, the median time of a step, and the spectral radius at the start. If control is lost, the line
gives the time of the loss instead.
"""

from __future__ import annotations

import numpy as np

from lessons import load_scene, prepared, run, summary
from robots import Plant, convergence_gauge


def main(seconds: float = 2.0) -> None:
    """Prints the results that the module describes."""
    scene = load_scene("planar3-circle")
    for horizon in (1, 5, 20):
        print(f"N = {horizon}: {_outcome((f'horizon={horizon}',), seconds)}")

    M = Plant(scene.robot, scene.settings.plant).mass_matrix()
    for scale in (0.3, 1.0, 2.0, 4.0):
        _, radius = convergence_gauge(M, scale * scene.robot.M_bar)
        print(f"M̄ × {scale:g}: {_outcome((f'M_bar_scale={scale}',), seconds)}, spectral radius {radius:.3f}")


def _outcome(assignments: tuple[str, ...], seconds: float) -> str:
    recording = run(prepared(load_scene("planar3-circle"), "himpc", assignments), seconds)
    told = summary(recording)
    if told["diverged"]:
        return f"control lost at {told['diverged_at_s']:.3f} s"
    error = recording["error/position"]
    rms = np.sqrt((error[len(error) // 4 :] ** 2).sum(axis=1).mean())
    return f"RMS error {1e6 * rms:.2f} µm, step {told['step_ms']['median']:.3f} ms"


if __name__ == "__main__":
    main()
