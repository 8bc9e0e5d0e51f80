"""Random drags into the floor, into the robot and out of reach; they are a small part of
`benchmarks.avoidance`."""

from __future__ import annotations

from itertools import product

import numpy as np
import pytest

from benchmarks.avoidance import FAST, FAST_OFF, HARD_N, ROBOTS, run
from lessons.events import MoveTarget, Set
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.session.torque import TorqueSession

SEED = 2
OFF = ["avoidance.on=false"]


PUSH = (("iiwa14", True), ("baxter", False), ("generated", False))
"""Robots, and whether a target moves often, whose drags are made at every push."""
KEEP = pytest.mark.nightly(
    "benchmarks/avoidance.py", "himpc/controllers", "himpc/limits", "himpc/tick", "robots/covering"
)


@pytest.mark.parametrize(
    ("robot", "often"),
    [each if each in PUSH else pytest.param(*each, marks=KEEP) for each in product(ROBOTS, (False, True))],
)
def test_no_drag_makes_a_robot_touch_or_loses_it(robot: str, often: bool) -> None:
    """With default settings no force between bodies whose distance is kept exceeds 50 N, and joints stay
    within 105 % of their velocity limits."""
    total, _ = run(robot, 1, SEED, [], "himpc", often=often)
    assert total.force <= HARD_N, total.where
    assert total.lost == 0
    assert total.speed <= FAST


@pytest.mark.parametrize("robot", ["iiwa14", pytest.param("panda", marks=KEEP)])
def test_without_rows_a_robot_that_hits_the_floor_stays_calm(robot: str) -> None:
    """If no distance is kept, these drags end in the floor. The guard of a blocked robot keeps the joints
    within 1.5 times their limits, and the robot comes to rest."""
    total, _ = run(robot, 1, SEED, OFF, "himpc")
    assert total.force > HARD_N
    assert total.speed <= FAST_OFF
    assert total.lost == 0
    assert total.resting == total.chains


def test_without_the_guard_the_torque_winds_up() -> None:
    """The printed controller throws the iiwa in the drags of the test before."""
    printed, _ = run("iiwa14", 1, SEED, [*OFF, "limits.stall_guard=false"], "himpc")
    assert printed.speed > 2.0 * FAST_OFF
    assert printed.force > 2000.0


def test_without_rows_baxter_does_not_fall_into_itself() -> None:
    """The guard slows down the joints that a loaded shoulder carries. Without it, an elbow falls on the
    torso."""
    total, _ = run("baxter", 1, SEED, OFF, "himpc", often=True)
    assert total.force <= HARD_N, total.where
    assert total.speed <= FAST_OFF
    assert total.resting == total.chains


@pytest.mark.parametrize(
    ("path", "values"), [("levels.1.Q", (200.0, 201.0)), ("M_bar_scale", (1.0, 1.01)), ("horizon", (5, 6))]
)
def test_a_slider_that_moves_meanwhile_does_not_wind_the_torque_up(
    path: str, values: tuple[float, float]
) -> None:
    """The guard of a blocked robot keeps what it knows of the joints when settings change thirty times a
    second. Begun anew at each change, it let the arm jump at 6.7 times its limits off the table."""
    session = begin(RunSpec("iiwa14-table", set=tuple(OFF)).prepared(), 0)
    assert isinstance(session, TorqueSession)
    target = session.target("position")
    assert target is not None
    above = np.array(target.raw, float)
    below, fastest, v = above - (0.0, 0.0, above[2] + 0.15), 0.0, session.layout.fields["v"]
    for tick in range(6000):
        if tick % 80 == 0:
            session.post(MoveTarget("position", tuple(below if 300 < tick < 3500 else above)))
        if tick % 33 == 0:
            session.post(Set(path, values[(tick // 33) % 2]))
        session.drain()
        fastest = max(fastest, float(np.abs(session.tick()[v] / session.robot.v_limit).max()))
    assert fastest <= FAST_OFF
