"""Every robot of the catalog agrees with the published data from which it was made."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pinocchio as pin
import pytest

from robots import CATALOG, InputError, Robot, load_robot, load_urdf_text
from robots.inertia import mass_matrix


@pytest.mark.parametrize("name", CATALOG)
def test_catalog_robot_is_sound(name: str) -> None:
    robot = load_robot(name)
    assert robot.model.nq == robot.model.nv == robot.n == len(robot.joint_names)
    assert robot.tip in robot.frames
    assert np.all(robot.home > robot.q_lower)
    assert np.all(robot.home < robot.q_upper)
    for values in (robot.v_limit, robot.tau_limit, robot.a_max, robot.M_bar):
        assert np.all(np.isfinite(values))
        assert np.all(values > 0.0)
    assert not robot.report.of_kind("repaired")
    assert not robot.report.of_kind("filled")
    J = pin.computeFrameJacobian(
        robot.model, robot.model.createData(), robot.home, robot.frame_id(robot.tip), pin.LOCAL_WORLD_ALIGNED
    )
    assert np.linalg.svd(J, compute_uv=False)[: min(6, robot.n)].min() > 0.02
    with pytest.raises(ValueError, match="read-only"):
        robot.home[0] = 1.0


@pytest.mark.parametrize("name", CATALOG)
def test_catalog_robot_holds_its_own_weight(name: str) -> None:
    robot = load_robot(name)
    gravity = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.home)
    assert np.all(np.abs(gravity) < 0.7 * robot.tau_limit)


def test_iiwa_tool_centre_point_at_the_papers_configuration() -> None:
    robot = load_robot("iiwa14")
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.radians([0, 60, 0, 60, 0, 0, 0]))
    pose = data.oMf[robot.frame_id("flange")]
    np.testing.assert_allclose(pose.translation, [0.42 * np.sin(np.pi / 3), 0.0, 1.096], atol=1e-12)
    np.testing.assert_allclose(pose.rotation, np.eye(3), atol=1e-12)


def test_iiwa_data_sheet() -> None:
    robot = load_robot("iiwa14")
    np.testing.assert_allclose(np.degrees(robot.q_upper), [170, 120, 170, 120, 170, 120, 175])
    np.testing.assert_allclose(np.degrees(robot.q_lower), -np.degrees(robot.q_upper))
    np.testing.assert_allclose(np.degrees(robot.v_limit), [85, 85, 100, 75, 130, 135, 135])
    np.testing.assert_allclose(robot.tau_limit, [320, 320, 176, 176, 110, 40, 40])
    assert sum(inertia.mass for inertia in robot.model.inertias) == pytest.approx(17.5)


def test_planar_arm_is_three_uniform_rods() -> None:
    robot = load_robot("planar3")
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.radians([0, 90, -90]))
    np.testing.assert_allclose(data.oMf[robot.frame_id("ee")].translation, [0.6, 0.3, 0.0], atol=1e-12)
    for inertia, mass in zip(list(robot.model.inertias)[1:], (0.6, 0.5, 0.4), strict=True):
        assert inertia.mass == pytest.approx(mass)
        np.testing.assert_allclose(inertia.lever, [0.15, 0, 0])
        assert inertia.inertia[2, 2] == pytest.approx(mass * 0.3**2 / 12)
    np.testing.assert_allclose(pin.computeGeneralizedGravity(robot.model, data, robot.home), 0.0, atol=1e-12)


def test_panda_flange_and_hand() -> None:
    robot = load_robot("panda")
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, np.zeros(7))
    np.testing.assert_allclose(data.oMf[robot.frame_id("flange")].translation, [0.088, 0, 0.926], atol=1e-9)
    pin.framesForwardKinematics(robot.model, data, robot.home)
    rotation = data.oMf[robot.frame_id("hand_tcp")].rotation
    np.testing.assert_allclose(rotation[:, 2], [0, 0, -1], atol=1e-6)


@pytest.mark.parametrize("name", CATALOG)
def test_robot_survives_pickling_and_its_own_urdf(name: str) -> None:
    robot = load_robot(name)
    from_text = load_urdf_text(robot.urdf_text, robot.tip)
    from_text.model.armature = robot.model.armature  # a URDF does not tell the inertia of rotors
    for copy in (pickle.loads(pickle.dumps(robot)), from_text):
        assert copy.model == robot.model
        assert copy.frames == robot.frames
        assert copy.tip == robot.tip


def test_mistakes_get_one_helpful_sentence() -> None:
    with pytest.raises(InputError, match=r"'iiwa41'.*did you mean 'iiwa14'"):
        load_robot("iiwa41")
    with pytest.raises(InputError, match=r"Cannot read.*no/such/arm\.urdf"):
        load_robot("no/such/arm.urdf")
    with pytest.raises(InputError, match=r"'flnge'.*did you mean 'flange'"):
        load_robot("iiwa14", tip="flnge")
    with pytest.raises(InputError, match="link_7"):
        load_robot("iiwa14").frame_id("tool0")


def test_tip_can_be_chosen() -> None:
    assert load_robot("panda", tip="flange").tip == "flange"


def test_heavy_libraries_stay_behind_their_doors() -> None:
    code = "import sys, robots; print([m for m in ('trimesh', 'viser') if m in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_a_tool_changes_nothing_but_the_tip() -> None:
    """Home, M̄, limits and shapes are those of the catalog."""
    bare, robot = load_robot("panda"), load_robot("panda", "@0,0,0.1")
    assert robot.collision == bare.collision and robot.cover == bare.cover
    for name in ("home", "M_bar", "a_max", "tau_limit", "v_limit", "q_lower", "q_upper"):
        np.testing.assert_array_equal(getattr(robot, name), getattr(bare, name))
    assert "tool" in robot.frames and set(robot.frames) - {"tool"} == set(bare.frames)


@pytest.mark.parametrize(("name", "hold"), [
    ("panda", "joint[13]"), ("planar3", "joint_2"), ("ridgeback-ur10", "base.*"), ("baxter", "left.*"),
    ("iiwa14", "joint_7"),
])  # fmt: skip
def test_held_joints_leave_the_rest_as_it_is(name: str, hold: str) -> None:
    """The other joints keep their home, M̄ and deceleration, and all shapes their places at home. M⁻¹M̄ has no
    larger eigenvalue than without held joints, so M̄ need not be estimated again."""
    whole, robot = load_robot(name), load_robot(name, hold=(hold,))
    kept = [whole.joint_names.index(joint) for joint in robot.joint_names]
    assert 0 < robot.n < whole.n
    for field in ("home", "M_bar", "a_max", "tau_limit", "v_limit"):
        np.testing.assert_array_equal(getattr(robot, field), getattr(whole, field)[kept])
    for shapes in (_at_home, _capsules_at_home):
        now, before = shapes(robot), shapes(whole)
        assert now.keys() == before.keys() and before
        for key, points in before.items():
            np.testing.assert_allclose(now[key], points, atol=1e-9)
    largest = [float(np.linalg.eigvalsh(_scaled(each))[-1]) for each in (robot, whole)]
    assert largest[0] <= largest[1] + 1e-9


def test_a_pattern_with_a_value_holds_a_joint_there() -> None:
    whole, robot = load_robot("panda"), load_robot("panda", hold=("joint4=-3", "joint[67]"))
    assert "held at -3 rad" in str(robot.report.findings)
    pairs = {frozenset(pair.names) for pair in robot.collision.excluded}
    assert pairs >= {frozenset(("link1", "link2")), frozenset(("link2", "link3"))}
    assert len(robot.collision.solids) == len(whole.collision.solids)


def test_a_robot_whose_joints_are_all_held_is_refused() -> None:
    with pytest.raises(InputError, match="none of its joints moves"):
        load_robot("planar3", hold=("joint_.*",))


def _scaled(robot: Robot) -> np.ndarray:
    root = np.sqrt(robot.M_bar)
    M = mass_matrix(robot.model, robot.model.createData(), robot.home)
    return root[:, None] * np.linalg.inv(M) * root


def _placed(robot: Robot, joint: int, points: np.ndarray) -> np.ndarray:
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, robot.home)
    return np.array([data.oMi[joint].act(point) for point in points])


def _at_home(robot: Robot) -> dict[tuple[str, int], np.ndarray]:
    """Returns three points of each solid's axes and the corners of its hull, in the world, m."""
    found: dict[tuple[str, int], np.ndarray] = {}
    for solid in robot.collision.solids:
        w, x, y, z = solid.quaternion
        axes = pin.Quaternion(w, x, y, z).toRotationMatrix().T + np.array(solid.position)
        points = np.array([*axes, *solid.points])
        number = sum(link == solid.link for link, _ in found)
        found[solid.link, number] = _placed(robot, solid.joint, points)
    return found


def _capsules_at_home(robot: Robot) -> dict[tuple[str, int], np.ndarray]:
    """Returns the ends of each capsule in the world, m."""
    found: dict[tuple[str, int], np.ndarray] = {}
    assert robot.cover is not None
    for capsule in robot.cover.capsules:
        number = sum(link == capsule.link for link, _ in found)
        found[capsule.link, number] = _placed(robot, capsule.joint, np.array([capsule.start, capsule.end]))
    return found
