"""Whatever the mouse does, the arm stays calm: with the default settings of scenes with dragged targets, and
with distances off."""

from __future__ import annotations

import numpy as np
import pytest

from lessons.events import MoveTarget
from lessons.recording.run import Recording, run
from lessons.recording.summary import summary
from lessons.scenes.names import SCENES
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings

INTO, ABOVE, UNDER = (0.556, 0.0, 0.05), (0.556, 0.0, 0.45), (0.556, 0.0, -0.4)
DEEP = ((0.1, MoveTarget("position", INTO)), (3.0, MoveTarget("position", ABOVE)))
"""The target is dragged 15 cm into the table, and after 2.9 s to 25 cm above it."""
PRINTED = tuple(
    each for each in SCENES if each.startswith(("planar3-c", "planar3-s", "planar3-p", "iiwa14-c"))
)
"""The scenes of the papers, and the scene whose QP is drawn."""


def dragged(*changes: str) -> Recording:
    return run(RunSpec("iiwa14-table", set=changes, events=DEEP, duration=6.0).prepared(), to_the_end=True)


def fastest(found: Recording) -> float:
    """Returns the largest share of the robot's velocity limits."""
    return float((np.abs(found["v"]) / found.session.robot.v_limit).max())


@pytest.mark.parametrize("name", [each for each in SCENES if each != "hold"])
def test_scenes_with_dragged_targets_keep_distances(name: str) -> None:
    settings = RunSpec(name).prepared().settings
    assert isinstance(settings, TorqueSettings)
    assert settings.limits.avoidance.on is (name not in PRINTED)
    assert settings.limits.stall_guard is (name not in PRINTED)


def test_a_target_deep_in_the_table_does_not_throw_the_arm() -> None:
    """With default settings the arm touches nothing, stays within its limits, and arrives."""
    found = dragged()
    assert found["contact_force"].max() == 0.0
    assert fastest(found) <= 1.05
    assert np.linalg.norm(found["error/position"][-1]) < 1e-3
    assert float(np.abs(found["v"][-100:]).max()) < 0.05


def test_without_distances_the_torque_does_not_wind_up() -> None:
    """The arm presses on the table, but it neither breaks away nor throws itself when the target leaves."""
    found = dragged("avoidance.on=false")
    assert fastest(found) <= 1.5
    assert np.linalg.norm(found["error/position"][-1]) < 1e-3
    assert float(np.abs(found["v"][-100:]).max()) < 0.05
    printed = dragged("avoidance.on=false", "limits.stall_guard=false")
    assert fastest(printed) > 3.0


def test_a_target_out_of_reach_is_not_a_loss() -> None:
    """The hand stays above the table, 0.6 m from its target, and the run goes on and is within its limits."""
    events = ((0.1, MoveTarget("position", UNDER)),)
    found = run(RunSpec("iiwa14-table", events=events, duration=4.0).prepared())
    assert len(found["t"]) == 4000
    assert summary(found)["diverged"] is False
    assert np.linalg.norm(found["error/position"][-1]) > 0.5


def test_the_largest_speed_is_a_share_of_the_users_limit() -> None:
    """While an arm comes to rest, the guard lowers its velocity limits. The summary compares the speed with
    the limit that the user has set."""
    events = ((0.1, MoveTarget("position", UNDER)),)
    spec = RunSpec("iiwa14-table", set=("limits.velocity_scale=0.1",), events=events, duration=8.0)
    found = run(spec.prepared(), to_the_end=True)
    limit = 0.1 * found.session.robot.v_limit
    assert found["v_limit"] == pytest.approx(np.tile(limit, (len(found["t"]), 1)))
    assert found["v_limit_lowered"][-1].max() < 0.5 * limit.min()
    expected = float((np.abs(found["v"]) / limit).max())
    assert summary(found)["limits"]["velocity"]["max_ratio"] == pytest.approx(expected)
    assert expected < 1.05
