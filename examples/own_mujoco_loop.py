"""The controller in your own MuJoCo loop: your model, your step, your rate, without this project's plant.

The controller knows the arm's geometry and limits from a URDF. MuJoCo simulates an arm with other masses and
with friction, which the controller does not know. Prints how many control steps were taken, and the largest
distance between the hand and its circular path.
"""

from __future__ import annotations

import mujoco
import numpy as np

from himpc import HIMPC, FramePosition, Joints, Level, Settings
from himpc.references import Circle, Hold, Phase, previews
from robots import CATALOG, load_robot

T_S = 1e-3
N = 5


def main(seconds: float = 2.0) -> None:
    """Prints the results that the module describes."""
    model = mujoco.MjModel.from_xml_path(str(CATALOG["planar3"].path))
    model.opt.timestep = T_S
    model.opt.integrator = mujoco.mjtIntegrator.mjINT_IMPLICITFAST
    model.body_mass[1:] *= 1.2
    model.dof_armature[:] = 0.05, 0.05, 0.03
    model.dof_damping[:] = 0.15, 0.1, 0.08
    data = mujoco.MjData(model)

    robot = load_robot("planar3")
    stack = (
        Level((FramePosition(name="hand", axes="xy", K_p=200.0, K_v=20.0),), Q=200.0, R=10.0),
        Level((Joints(name="q1", joints=robot.joint_names[:1]),)),
    )
    controller = HIMPC(robot, Settings(stack, tuple(robot.M_bar), horizon=N, T_s=T_S))

    data.qpos[:] = robot.home
    controller.reset(np.zeros(robot.n))
    circle = Circle(
        np.array([0.5, 0.3]), np.array([0.1, 0.0]), np.array([0.0, 0.1]), Phase(np.pi / 4, "eased")
    )
    references = {"hand": circle, "q1": Hold(robot.home[:1])}

    largest, tau = 0.0, np.zeros(robot.n)
    steps = round(seconds / T_S)
    for _ in range(steps):
        # Time-delay estimation needs the torque that acted since the last step.
        plan = controller.step(data.qpos, data.qvel, previews(references, data.time, T_S, N), tau)
        tau = plan.tau
        data.qfrc_applied[:] = tau
        mujoco.mj_step(model, data)
        largest = max(largest, float(np.linalg.norm(plan.errors["hand"])))
    print(f"control steps: {steps}")
    print(f"largest distance: {1e3 * largest:.3f} mm")


if __name__ == "__main__":
    main()
