"""The arm of `benchmarks.franka`: franka-sim with a given robot, at 127.0.0.1 only.

    python franka_server.py ROBOT.xml ROBOT.urdf M_BAR Q_0 CLOCK

This script runs in another Python environment, because franka-sim needs an older MuJoCo and NumPy. M_BAR and
Q_0 are numbers separated by commas. M_BAR is proportional to the gains with which the arm itself holds its
posture, and Q_0 is the arm's initial posture. If CLOCK is "step", the arm waits for the answer to its last
state, moves by one period and sends the next state, as if its drives and its network shared a clock. If CLOCK
is "own", franka-sim works as usual: the simulation runs beside the network.
"""

import logging
import sys
import time
from importlib import import_module
from typing import Any

import numpy as np

simulation: Any = import_module("franka_sim.mujoco_franka_sim")
FrankaSimServer: Any = import_module("franka_sim").FrankaSimServer


class Stepped(simulation.MujocoFrankaSim):
    """A simulation that moves only when its method `step` is called."""

    def run_simulation(self):
        self._read_and_publish_state()
        while self.running:
            time.sleep(0.05)


class SteppedServer(FrankaSimServer):
    """Moves the arm by one period after the answer to the last state has arrived."""

    def _drain_gate(self, answer_deadline):
        late = super()._drain_gate(answer_deadline)
        self.physics_sim.step()
        now = self.physics_sim.get_robot_state()
        self.robot_state.state.update({name: now[name] for name in ("q", "dq", "tau_J")})
        return late


def main(robot, urdf, M_bar, q_0, clock):
    logging.basicConfig(level=logging.WARNING, format="%(levelname)s %(message)s")
    numbers = [np.array([float(each) for each in text.split(",")]) for text in (M_bar, q_0)]
    simulation.ARM_POSITION_KP, simulation.ARM_POSITION_KD = 2500.0 * numbers[0], 100.0 * numbers[0]
    simulation.ARM_INITIAL_Q = numbers[1]
    kind, server = (
        (Stepped, SteppedServer) if clock == "step" else (simulation.MujocoFrankaSim, FrankaSimServer)
    )
    server(
        host="127.0.0.1",
        physics_sim=kind(model_path=robot),
        urdf_path=urdf,
        enable_gripper=False,
        enforce_comm_constraints=True,
        enforce_motion_limits=True,
    ).start()


if __name__ == "__main__":
    main(*sys.argv[1:])
