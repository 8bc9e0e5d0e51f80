"""The printed equations run without Numba."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
from hypothesis import example, given, settings
from hypothesis import strategies as st

from himpc.references import Caps, Target
from himpc.rotation import exp3
from himpc.tick.target import dragged_target

HERE = Path(__file__).parent
T_S = 1e-3

WITHOUT_NUMBA = """
import sys
sys.modules["numba"] = None  # whoever imports it is told that it is not there
import numpy as np
from himpc import FrameOrientation, FramePosition, Level, Posture, Settings
from himpc.cascade.cascade import solve_cascade
from himpc.formulation.forms import measure, prepare
from himpc.kinematics.configuration import Configuration
from himpc.limits import build_rows, in_force
from himpc.missions import Mission
from himpc.plan import Plan, write_plan
from himpc.prediction.joint import JointState
from himpc.references import Target, previews
from himpc.telemetry import layout_of
from robots import load_robot

robot = load_robot("iiwa14")
levels = (FramePosition(name="hand"), FrameOrientation(name="wrist"), Posture(name="posture"))
settings = Settings(tuple(Level((task,)) for task in levels), tuple(robot.M_bar), route="explicit")
q, v = np.array(robot.home), np.full(robot.n, 0.05)
here = Configuration(robot, robot.model.createData(), q, v, knots=[q] * (settings.horizon - 1))
references = {task.name: Target(task.target(here)) for task in levels}
references["hand"].move(references["hand"].value + 0.05)
for k in range(100):
    ahead = previews(references, k * settings.T_s, settings.T_s, settings.horizon)
form = prepare(robot, settings).form
J = form.jacobian(here)
free = form.free(measure(form.tasks, here, ahead, {}, {}), J[0] @ v, np.zeros(len(form.root_Q)), ahead, 5)
M_bar, limits = np.array(settings.M_bar), in_force(robot, settings.limits)
rows = build_rows(JointState(q, v, 0.0 * v), 0.0 * v, M_bar, settings.limits, limits, 5, settings.T_s)
problems = [level.problem(J / M_bar, free, form.root_Q * free, 1.0) for level in form.levels]
solved = solve_cascade(problems, rows, {}, "daqp")
assert [level.fallback for level in solved] == ["solve"] * len(problems) and len(problems) > 2
assert max(level.kkt_residual for level in solved) < 1e-6 and np.abs(solved[-1].U).max() > 1e-3
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


@given(st.integers(0, 2**32 - 1), st.booleans(), st.integers(1, 12))
@settings(max_examples=20)
@example(2453302, False, 1)  # a small component beside large ones
def test_the_compiled_filter_of_a_target_is_the_printed_one(seed: int, rotates: bool, N: int) -> None:
    """Both filters give the same motion up to rounding, and come to rest at the same time."""
    rng = np.random.default_rng(seed)
    caps = Caps(*rng.uniform((0.1, 0.5, 10.0), (2.0, 8.0, 200.0)))
    start = exp3(rng.normal(0, 1, 3)) if rotates else rng.normal(0, 1, 3)
    printed, compiled = Target(start, caps), dragged_target(start, caps)
    moves = {int(k): rng.normal(0, 0.3, 3) for k in rng.integers(0, 300, 3)}
    moved = 0.0
    for k in range(400):
        if k in moves:
            goal = exp3(moves[k]) @ start if rotates else start + moves[k]
            printed.move(goal)
            compiled.move(goal)
        expected, found = (target.preview(k * T_S, T_S, N) for target in (printed, compiled))
        for one, other in zip(expected, found, strict=True):
            size = max(1.0, float(np.abs(one).max()))
            np.testing.assert_allclose(other, one, rtol=0.0, atol=1e-8 * size)
        moved = max(moved, float(np.abs(expected.velocity).max()))
    assert moved > 1e-3
