"""A task: coordinates of the robot with their Jacobian. This task is the distance of the tip from the z axis.

    himpc-lab run FILE.py

runs the task on the iiwa, on a level of its own below that of the hand's position. Before the robot moves,
finite differences of the value are compared with the Jacobian.
"""

from dataclasses import dataclass

import numpy as np

from himpc.tasks import Task


@dataclass(frozen=True, kw_only=True)
class Reach(Task):
    """The coordinate x = √(p_x² + p_y²), m, of a frame at p. The empty name means the robot's tip."""

    frame: str = ""

    def coordinates(self, robot):
        """Names of the m coordinates."""
        return ("reach",)

    def value(self, configuration):
        """Returns x at the measured state, (m,)."""
        p = configuration.placement(self.frame).translation
        return np.array([np.hypot(p[0], p[1])])

    def error(self, value, desired):
        """x̃ = x − x_d, (m,)."""
        return value - desired

    def jacobian(self, configuration):
        """∂x/∂q at every knot of the horizon, (N, m, n)."""
        J = configuration.frame_jacobians(self.frame)[:, :3]  # ∂p/∂q, (N, 3, n)
        p = configuration.placement(self.frame).translation
        direction = np.array([p[0], p[1], 0.0]) / max(np.hypot(p[0], p[1]), 1e-6)
        return (direction @ J)[:, None, :]


TASK = Reach(name="reach", K_p=100.0, K_v=20.0)
