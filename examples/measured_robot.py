"""A measured robot instead of a simulated one: read q and v from your source, send the torque to your bus.

The loop needs only `read` and `write` (joints in the order of the URDF; rad, rad/s, N·m). This driver returns
one invalid reading. Prints the ticks, the late ticks, the reaction to this reading, the hand's error.
"""

from __future__ import annotations

import math

import numpy as np

from himpc import HIMPC, FrameOrientation, FramePosition, Level, Posture, Settings
from himpc.controllers import dragged_target
from himpc.references import Hold, previews
from robots import Plant, PlantSettings, load_robot

T_S = 1e-3


class Driver:
    """Replace this class by your driver. `write` returns the torque that really acts."""

    def __init__(self) -> None:
        self.plant = Plant(load_robot("iiwa14"), PlantSettings(encoder_resolution_deg=0.001))

    def read(self) -> tuple[np.ndarray, np.ndarray]:
        state = self.plant.measure(T_S)
        return (state.q * math.nan if round(state.t / T_S) == 100 else state.q), state.v

    def write(self, tau: np.ndarray) -> np.ndarray:
        return self.plant.step(tau, T_S)


def main(seconds: float = 2.0) -> None:
    """Prints the results that the module describes."""
    robot, driver = load_robot("iiwa14"), Driver()
    tasks = FramePosition(name="hand"), FrameOrientation(name="wrist"), Posture(name="posture")
    controller = HIMPC(robot, Settings(tuple(Level((task,)) for task in tasks), tuple(robot.M_bar)))
    rotation, position = driver.plant.frame_pose(robot.tip)
    hand = dragged_target(position)
    hand.move(position + np.array([0.0, 0.0, 0.05]))
    references = {"hand": hand, "wrist": Hold(rotation), "posture": Hold(robot.home)}
    late, ticks, tau = 0, round(seconds / T_S), driver.plant.tau
    controller.reset(tau)
    for tick in range(ticks):
        q, v = driver.read()
        plan = controller.step(q, v, previews(references, tick * T_S, T_S, 5), tau)
        if plan.unsolved:
            print(f"broken reading: torque held to {np.abs(plan.tau - tau).max():.1e} N·m")
        late += plan.step_us > 1e6 * T_S
        tau = driver.write(plan.tau)
    print(f"ticks: {ticks}, of them late: {late}")
    off = np.linalg.norm(driver.plant.frame_pose(robot.tip)[1] - hand.raw)
    print(f"hand: {1e3 * off:.2f} mm from its goal")


if __name__ == "__main__":
    main()
