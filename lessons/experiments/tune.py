"""Finds M̄ without a model by Remark 4 of the HIMPC paper, step by step."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np

from lessons.recording.run import Recording, run
from lessons.recording.summary import summary
from lessons.scenes.scene import TorqueScene
from robots import InputError

MAX_STEPS = 60


@dataclass(frozen=True)
class Trial:
    """One trial.

    Attributes:
        scale: factor on the scene's M̄.
        M_bar: the diagonal tried, kg·m².
        error: RMS of the level-1 error in the second half of the run, m or rad.
        roughness: RMS of Δτ divided by the joint's torque limit, over the joints and the ticks of the second
            half.
        gauge: largest spectral radius of I − M⁻¹M̄ during the run; it is unknown for a real robot.
        verdict: "go on", "too small", "satisfactory", "noisy" or "control lost".
    """

    scale: float
    M_bar: tuple[float, ...]
    error: float
    roughness: float
    gauge: float
    verdict: str


def tune(
    scene: TorqueScene,
    start: float,
    factor: float,
    accuracy: float,
    noise: float,
    seconds: float,
    seed: int = 0,
) -> Iterator[Trial]:
    """Yields the trials of Remark 4: M̄ is small at first, and increases until tracking is satisfactory or
    the closed loop almost shows a noisy response.

    All M̄_i increase by the same factor. `chosen` returns the best trial.

    Args:
        scene: the scene; its M̄ gives the proportions between the joints.
        start: first factor on the scene's M̄.
        factor: factor from one step to the next, > 1.
        accuracy: a trial with a level-1 error below this, m or rad, is satisfactory.
        noise: a trial with a roughness above this is noisy.
        seconds: simulated seconds per step.
        seed: seed of the runs.

    Raises:
        InputError: an invalid start, factor, accuracy or noise.
    """
    for name, value in (("start", start), ("accuracy", accuracy), ("noise", noise)):
        if not (math.isfinite(value) and value > 0):
            raise InputError(f"--{name} is {value}: give a finite number above 0")
    if not 1.01 <= factor <= 10:
        raise InputError(f"--factor is {factor}: give a factor from 1.01 to 10, e.g. 1.5")
    scale, kept_control = start, False
    for _ in range(MAX_STEPS):
        settings = scene.settings.changed("M_bar_scale", scene.settings.M_bar_scale * scale)
        recording = run(replace(scene, settings=settings), seconds, seed)
        error, roughness = _error(recording), _roughness(recording)
        if recording.session.diverged_at is not None:
            # If no step has kept control before, lost control means that M̄ is too small, otherwise that it
            # is too large.
            verdict = "control lost" if kept_control else "too small"
        elif roughness > noise:
            verdict = "noisy"
        else:
            verdict = "satisfactory" if error <= accuracy else "go on"
            kept_control = True
        yield Trial(
            scale=scale,
            M_bar=tuple(float(f"{value * settings.M_bar_scale:.3g}") for value in settings.M_bar),
            error=error,
            roughness=roughness,
            gauge=float(np.nanmax(recording["gauge_radius"])),
            verdict=verdict,
        )
        if verdict not in ("go on", "too small"):
            return
        scale *= factor


def chosen(steps: list[Trial]) -> Trial | None:
    """Returns the step with the least error among those that kept control without noise; None if there is no
    such step."""
    good = [step for step in steps if step.verdict in ("go on", "satisfactory")]
    return min(good, key=lambda step: step.error, default=None)


def _error(recording: Recording) -> float:
    first = min(summary(recording)["tasks"], key=lambda task: task["level"])["name"]
    error = recording[f"error/{first}"]
    return float(np.sqrt((error[len(error) // 2 :] ** 2).sum(axis=1).mean()))


def _roughness(recording: Recording) -> float:
    steps = recording["delta_tau"] / recording.session.robot.tau_limit
    return float(np.sqrt((steps[len(steps) // 2 :] ** 2).mean()))
