"""The printed equations run without Numba."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).parent

WITHOUT_NUMBA = """
import sys
sys.modules["numba"] = None  # whoever imports it is told that it is not there
import numpy as np
from himpc import FrameOrientation, FramePosition, Level, Posture, Settings
from himpc.formulation.forms import measure, prepare
from himpc.kinematics.configuration import Configuration
from himpc.limits import build_rows, in_force
from himpc.missions import Mission
from himpc.plan import Plan, write_plan
from himpc.prediction import JointState
from himpc.printed import cascade
from himpc.references import Circle, Hold, Phase, previews
from himpc.telemetry import layout_of
from robots import load_robot

robot = load_robot("iiwa14")
levels = (FramePosition(name="hand"), FrameOrientation(name="wrist"), Posture(name="posture"))
settings = Settings(tuple(Level((task,)) for task in levels), tuple(robot.M_bar))
q, v = np.array(robot.home), np.full(robot.n, 0.05)
here = Configuration(robot, robot.model.createData(), q, v, knots=[q] * (settings.horizon - 1))
references = {task.name: Hold(task.target(here)) for task in levels}
u, w, _ = np.eye(3) / 9
references["hand"] = Circle(levels[0].target(here) + 0.05, u, w, Phase(1.0, "uniform"))
ahead = previews(references, 0.1, settings.T_s, settings.horizon)
form = prepare(robot, settings).form
J = form.jacobian(here)
error, still = measure(form.tasks, here, ahead, {}, {}), np.zeros(sum(form.sizes))
free = form.model.free(error, J[0] @ v, still, *form.motion(ahead, 5)[:, 1:])
M_bar, limits = np.array(settings.M_bar), in_force(robot, settings.limits)
rows = build_rows(JointState(q, v, 0.0 * v), 0.0 * v, M_bar, settings.limits, limits, 5, settings.T_s)
problems = [level.problem(J / M_bar, free) for level in form.levels]
solved = cascade(problems, rows.matrix, rows.lower.ravel(), rows.upper.ravel(), np.zeros((5, robot.n)))
assert all(level.solved for level in solved) and len(problems) > 2
assert max(level.residual for level in solved) < 1e-6 and np.abs(solved[-1].U).max() > 1e-3
assert not [name for name in sys.modules if name.startswith(("himpc.tick", "himpc.compilation"))]
print(layout_of(robot, settings.stack).size)
"""


def test_a_cascade_is_solved_where_numba_is_not_installed() -> None:
    """Tasks, references, limits, prediction, cascade, missions and rows of telemetry work without Numba."""
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_NUMBA], capture_output=True, text=True, cwd=HERE.parents[1]
    )
    assert done.returncode == 0, done.stderr
    assert int(done.stdout) > 100
