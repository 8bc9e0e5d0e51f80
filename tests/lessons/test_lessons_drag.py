"""The verdict by motion: a target is dragged away and back, and what the robot does is said in one line."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from himpc.tick.distances import Distances
from lessons.events import MoveTarget
from lessons.experiments.drag import Motion, dragged, target
from lessons.scenes.hold import hold_robot
from lessons.session.start import begin
from robots import Robot, load_robot, load_urdf_text

FIELD = Path(__file__).parents[1] / "robots" / "field"


@pytest.mark.parametrize("name", ["no_inertials_7_joints", "light_wrist_7_joints"])
def test_the_check_ends_with_the_motion(capfd: pytest.CaptureFixture[str], name: str) -> None:
    """Both arms have no rotor inertia in their files, without which they would swing or be far too fast."""
    file = str(FIELD / f"{name}.urdf")
    assert main(["robots", "--check", file, "--json", "-"]) == 0
    told = json.loads(capfd.readouterr().out)["motion"]
    assert told["follows"] is True and told["rest"] is True
    assert 0.0 < told["torque"] <= 1.0 and 0.0 < told["speed"] <= 1.05
    assert max(told["error"], told["back"]) < 1e-2 * told["drag"]
    assert told["text"].startswith("follows within")
    assert main(["robots", "--check", str(FIELD / "tetra_mm.dae")]) == 1
    assert "motion" not in capfd.readouterr().out


def test_one_line_a_finding_and_the_verdict_last(capfd: pytest.CaptureFixture[str]) -> None:
    """The tip of this arm is moved by two joints, so that its target is on a surface."""
    assert main(["robots", "--check", str(FIELD / "limits_1e16.urdf")]) == 0
    first, *findings, last = capfd.readouterr().out.strip().splitlines()
    assert first.endswith("can be used: 3 joints, tip 'link3'")
    assert all(line.split(":")[0] in ("filled", "note", "repaired", "fixed") for line in findings)
    assert last.startswith("motion: follows within") and last.endswith("; at rest")


def test_the_drag_stays_within_reach_and_above_the_floor() -> None:
    """A planar arm is dragged within its plane; a target that no joint can reach is no failure."""
    planar = load_robot("planar3")
    there = target(planar, 0.1, floor=False)
    home = target(planar, 0.0, floor=False)
    assert there is not None and home is not None
    assert there[2] == pytest.approx(home[2]) and np.linalg.norm(there - home) == pytest.approx(0.1, abs=2e-3)
    assert target(planar, 100.0, floor=False) is None
    lamp = load_robot(FIELD / "limits_in_degrees.urdf")
    low = target(lamp, 0.1, floor=True)
    assert low is not None and low[2] > 0.04


def test_the_drag_does_not_end_in_the_robots_own_base() -> None:
    """The place for which the joints turn least is in a block of the base: another one is taken."""
    text = (FIELD / "no_inertials_7_joints.urdf").read_text()
    free = load_urdf_text(text)
    there = target(free, 0.25, floor=False, kept=0.02)
    assert there is not None
    at = " ".join(map(str, there))
    block = f'<collision><origin xyz="{at}"/><geometry><box size="0.04 0.04 0.04"/></geometry></collision>'
    blocked = load_urdf_text(text.replace('<link name="l0"/>', f'<link name="l0">{block}</link>'))
    np.testing.assert_array_equal(blocked.home, free.home)
    other = target(blocked, 0.25, floor=False, kept=0.02)
    assert other is not None and np.linalg.norm(other - there) > 0.05
    assert dragged(blocked).follows


def heavy(length: float) -> Robot:
    """Returns an arm of two tonnes whose four links have this length, m."""
    parts = ['<link name="l0"/>']
    for k, axis in enumerate(("0 0 1", "0 1 0", "0 1 0", "0 1 0")):
        parts.append(
            f'<link name="l{k + 1}"><inertial><origin xyz="{0.5 * length} 0 0"/><mass value="500"/>'
            '<inertia ixx="20" iyy="50" izz="50" ixy="0" ixz="0" iyz="0"/></inertial></link>'
            f'<joint name="j{k}" type="revolute"><parent link="l{k}"/><child link="l{k + 1}"/>'
            f'<origin xyz="{length * min(k, 1)} 0 0"/>'
            f'<axis xyz="{axis}"/><limit lower="-2" upper="2" velocity="2" effort="0"/></joint>'
        )
    parts.append('<link name="tool0"/><joint name="at" type="fixed"><parent link="l4"/>')
    parts.append(f'<child link="tool0"/><origin xyz="{length} 0 0"/></joint>')
    return load_urdf_text(f'<robot name="heavy">{"".join(parts)}</robot>')


def test_a_long_arm_has_the_time_that_its_target_needs() -> None:
    """The target moves with 0.5 m/s, and needs more than the 2 s of a short drag for 1.05 m. An arm of 6.7 m
    was 150 mm behind, as its target was."""
    motion = dragged(heavy(1.75))
    assert motion.drag > 1.0 and motion.follows and motion.rest, str(motion)
    assert " after 3.1 s (drag of 1050 mm)" in str(motion) and Motion(0.3).seconds == 2.0


def test_a_robot_of_two_tonnes_follows_and_a_small_one_keeps_the_printed_weights() -> None:
    """In the units of a heavy robot, R = 10 per (N m)^2 would outweigh Q = 200 per (m/s^2)^2."""
    robot = heavy(1.0)
    motion = dragged(robot)
    assert motion.follows and motion.rest and motion.torque < 0.9, str(motion)
    assert hold_robot(robot).settings.R_on == "acceleration"
    assert hold_robot(load_robot("panda")).settings.R_on == "torque"


def test_a_drag_does_not_end_at_a_position_limit() -> None:
    """The controller stays 7 mrad away from a limit: each joint has at least 20 mrad left at the target."""
    text = (FIELD / "mimic_in_chain.urdf").read_text()
    motion = dragged(load_urdf_text(text.replace('lower="-2" upper="2"', 'lower="-0.175" upper="0.175"')))
    assert motion.follows, str(motion)


def small() -> Robot:
    """Returns an arm of 0.4 m with four joints, near its own base. It cannot keep the orientation of its
    hand, and a pair of links is always within 0.1 m of the distance that is kept."""
    parts = ['<link name="l0"/>']
    for k, (axis, at) in enumerate((("0 0 1", 0.05), ("0 1 0", 0.05), ("0 1 0", 0.12), ("0 1 0", 0.12))):
        parts.append(
            f'<link name="l{k + 1}"><inertial><origin xyz="0 0 0.05"/><mass value="0.15"/>'
            '<inertia ixx="1e-4" iyy="1e-4" izz="1e-4" ixy="0" ixz="0" iyz="0"/></inertial>'
            '<collision><origin xyz="0 0 0.05"/><geometry><cylinder radius="0.015" length="0.06"/></geometry>'
            f'</collision></link><joint name="j{k}" type="revolute"><parent link="l{k}"/>'
            f'<child link="l{k + 1}"/><origin xyz="0 0 {at}"/><axis xyz="{axis}"/>'
            '<limit lower="-2" upper="2" velocity="1" effort="35"/></joint>'
        )
    parts.append('<link name="tool0"/><joint name="at" type="fixed"><parent link="l4"/><child link="tool0"/>')
    return load_urdf_text(f'<robot name="small">{"".join(parts)}<origin xyz="0 0 0.1"/></joint></robot>')


def left_after_a_slow_drag(robot: Robot, speed: float) -> float:
    """Drags the target as the page does, by 60 mm in steps of 40 ms; returns how far the hand is from it 2 s
    later, m. speed: of the drag, m/s."""
    session = begin(hold_robot(robot), 0)
    position = session.target("position")
    assert position is not None
    start, way, steps = position.raw, np.array((0.0, 0.06, 0.0)), round(0.06 / speed / 0.04)
    for step in range(1, steps + 1):
        session.post(MoveTarget("position", tuple((start + step / steps * way).tolist())))
        for _ in range(40):
            session.tick()
    for _ in range(2000):
        session.tick()
    return float(np.linalg.norm(session.plant.frame_pose(robot.tip)[1] - start - way))


@pytest.mark.parametrize("speed", [0.005, 0.02, 0.04])
def test_a_robot_follows_a_target_that_is_dragged_slowly(
    monkeypatch: pytest.MonkeyPatch, speed: float
) -> None:
    """A task at a lower level cannot be fulfilled, and makes no progress. While the target moves, this does
    not count as a stall, however slowly it moves."""
    robot = small()
    assert left_after_a_slow_drag(robot, speed) < 1e-4
    if speed == 0.02:
        monkeypatch.setattr(Distances, "moving", 0.05)
        assert left_after_a_slow_drag(robot, speed) > 5e-3


def test_the_verdict_says_why_a_robot_does_not_follow() -> None:
    """An arm with links of 1 kg has motors of 0.6 N m: it cannot hold itself; the verdict names them."""
    text = (FIELD / "mimic_in_chain.urdf").read_text().replace("<robot ", '<robot underactuated="true" ')
    told = str(dragged(load_urdf_text(text.replace('effort="50"', 'effort="0.6"'))))
    assert "mm away" in told and "'j2' at the torque limit" in told, told


def test_the_verdict_names_joints_that_are_too_slow() -> None:
    text = (FIELD / "no_inertials_7_joints.urdf").read_text()
    told = str(dragged(load_urdf_text(re.sub('velocity="[^"]*"', 'velocity="0.05"', text))))
    assert "mm away" in told and "at the speed limit" in told, told


def test_what_is_not_good_is_said() -> None:
    assert str(Motion(0.0)).startswith("not dragged: no target")
    late = Motion(0.1, 0.01, 0.0, 1.0, 0.5, rest=False)
    assert not late.follows and "stays 10 mm away" in str(late) and "still moving" in str(late)
    assert "loses control 0.5 s" in str(Motion(0.1, lost=0.5))
    assert str(Motion(0.1, over=True)).startswith("not known")
