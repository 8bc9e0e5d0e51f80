"""Runs `himpc-lab` with a simulated arm that simulates one period whenever the loop reads, also on a busy
machine. A period takes four times as long as in real time, which reduces the load of a test to a quarter."""

from __future__ import annotations

import sys
from functools import partial
from typing import Any

import app.arm.guard as guard
import app.commands.arm as command
import app.commands.early  # noqa: F401  (must be the first import)
from app.__main__ import main
from robots import Plant
from tests.app.arm_bench import T_S, Scripted


def patient_arm(scene: Any, robot: str, real_time: bool, start: Any) -> Scripted:
    plant = Plant(scene.robot, scene.settings.plant, T_S)
    plant.reset(start)
    return Scripted(plant, lambda k, arm: None, 4 * T_S)


if __name__ == "__main__":
    command._arm = patient_arm
    guard.Tolerances = partial(guard.Tolerances, silent=60.0)  # type: ignore[misc]
    sys.exit(main())
