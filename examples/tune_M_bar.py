"""Tuning M̄ as Remark 4 of the paper says: begin small, increase it until the error is small or torques are
noisy.

Prints a line per trial: the factor on the scene's M̄, the error of level 1, the roughness of the torque and
the verdict; then the diagonal that was chosen, as an assignment for the command line.
"""

from __future__ import annotations

from lessons import chosen, torque_scene, tune


def main(seconds: float = 1.0) -> None:
    """Prints the results that the module describes."""
    trials = []
    scene = torque_scene("iiwa14-circle")
    for trial in tune(scene, start=0.1, factor=2.0, accuracy=5e-4, noise=0.05, seconds=seconds):
        print(
            f"M̄ × {trial.scale:g}: error {1e3 * trial.error:.3f} mm, roughness {trial.roughness:.4f}, "
            f"{trial.verdict}"
        )
        trials.append(trial)
    best = chosen(trials)
    if best is None:
        print("chosen: none, no trial kept control")
    else:
        print(f"chosen: M_bar=[{','.join(f'{value:g}' for value in best.M_bar)}]")


if __name__ == "__main__":
    main()
