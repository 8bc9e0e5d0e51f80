"""`himpc-lab tune`."""

from __future__ import annotations

from dataclasses import asdict, replace
from typing import Annotated

import tyro

from app.commands.output import write_json


def tune(
    scene: tyro.conf.Positional[str],
    start: float = 0.05,
    factor: float = 1.5,
    accuracy: float = 1e-4,
    noise: float = 0.05,
    duration: float | None = None,
    seed: int = 0,
    set: Annotated[tyro.conf.UseAppendAction[tuple[str, ...]], tyro.conf.arg(metavar="PATH=VALUE")] = (),
    json: str | None = None,
) -> int:
    """Find M̄ as Remark 4 of the HIMPC paper says: begin small, and increase M̄ until tracking is
    satisfactory or the torque becomes noisy. Every step is printed. Exit code 1 if no step kept control.

    Args:
        scene: name of a scene; its M̄ gives the proportions between the joints.
        start: first factor by which the scene's M̄ is multiplied.
        factor: factor from one step to the next.
        accuracy: level-1 error (RMS over the second half of the run) below which tracking is satisfactory, m
            or rad.
        noise: step of the torque from tick to tick (RMS), as a share of its limit, above which the torque is
            noisy.
        duration: simulated seconds per step; the scene's own by default.
        seed: seed of the runs, from 0 to 2⁶³ − 1.
        set: change a setting in all runs, e.g. --set plant.encoder_resolution_deg=0.001.
        json: write the steps as JSON to this file, or to standard output for "-".
    """
    from lessons.experiments.tune import chosen
    from lessons.experiments.tune import tune as tune_scene
    from lessons.scenes.catalog import torque_scene
    from lessons.scenes.run_spec import check_seed
    from lessons.settings.assignments import with_assignments

    check_seed(seed)
    loaded = torque_scene(scene)
    loaded = replace(loaded, settings=with_assignments(loaded.settings, set))
    seconds = loaded.duration if duration is None else duration
    steps = []
    for step in tune_scene(loaded, start, factor, accuracy, noise, seconds, seed):
        steps.append(step)
        if json is None:
            print(
                f"{len(steps):2}. M̄ × {step.scale:<7.3g} level-1 error {step.error:.3g}, "
                f"torque step {step.roughness:.3g} of the limit, "
                f"radius of I − M⁻¹M̄ {step.gauge:.3f}: {step.verdict}",
                flush=True,
            )
    found = chosen(steps)
    if json is not None:
        write_json({"steps": [asdict(step) for step in steps], "chosen": found and asdict(found)}, json)
    elif found is None:
        print("no step kept control: give a smaller --start, or check the scene with himpc-lab run")
    else:
        listed = ",".join(f"{value:g}" for value in found.M_bar)
        print(f"M̄ = diag({listed.replace(',', ', ')}) kg·m²: --set M_bar=[{listed}]")
    return 0 if found is not None else 1
