"""Swapping priorities while the robot moves: `configure` applies new settings without a jump of the torque.

The hand has the first priority and the posture the second; in the middle of the run they are swapped. Prints
the errors of hand and posture before the swap and at the end, and the largest step of the torque at the swap
beside the largest one elsewhere.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from himpc import HIMPC, FramePosition, Level, Posture, Settings
from himpc.controllers import dragged_target
from himpc.references import Hold, previews
from robots import Plant, load_robot


def main(seconds: float = 4.0) -> None:
    """Prints the results that the module describes."""
    robot = load_robot("panda")
    plant = Plant(robot)
    _, position = plant.frame_pose(robot.tip)
    stack = (
        Level((FramePosition(name="hand", K_p=100.0, K_v=20.0),)),
        Level((Posture(name="posture", K_p=100.0, K_v=20.0),)),
    )
    settings = Settings(stack, tuple(robot.M_bar))
    controller = HIMPC(robot, settings)
    controller.reset(plant.tau)
    hand = dragged_target(position)
    hand.move(position + np.array([0.0, 0.1, 0.0]))
    references = {"hand": hand, "posture": Hold(robot.home)}

    ticks, at_swap, elsewhere, errors = round(seconds / 1e-3), 0.0, 0.0, {}
    for tick in range(ticks):
        if tick == ticks // 2:
            print(f"before: {_words(errors)}")
            controller.configure(replace(settings, stack=stack[::-1]))
        state = plant.measure(1e-3)
        plan = controller.step(state.q, state.v, previews(references, plant.t, 1e-3, 5), plant.tau)
        step = float(np.abs(plan.tau - plan.tau_0).max())
        near = ticks // 2 <= tick < ticks // 2 + 50
        at_swap, elsewhere = (max(at_swap, step), elsewhere) if near else (at_swap, max(elsewhere, step))
        errors = plan.errors
        plant.step(plan.tau, 1e-3)
    print(f"after: {_words(errors)}")
    print(f"largest torque step: {at_swap:.3f} N·m at the swap, {elsewhere:.3f} elsewhere")


def _words(errors: dict[str, np.ndarray]) -> str:
    hand, posture = (np.linalg.norm(errors[name]) for name in ("hand", "posture"))
    return f"hand {1e3 * hand:.2f} mm, posture {np.degrees(posture):.2f}° off"


if __name__ == "__main__":
    main()
