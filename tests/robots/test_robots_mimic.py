"""Joints that follow (mimic) a joint that moves: a telescope, a parallelogram, a finger."""

from __future__ import annotations

import pickle

import numpy as np
import pinocchio as pin
import pytest
from arms import INERTIAL, full_mass_matrix, joint, link, load, robot

from app.link.poses import LinkPoses
from himpc import FramePosition, Level
from himpc.htmpc import HTMPCSettings, Placo
from himpc.htmpc.clearance import CollisionModel
from himpc.htmpc.kinematics import frame_at, placed
from himpc.kinematics.configuration import Configuration
from himpc.kinematics.geometry import geometry
from himpc.references import Hold
from lessons.experiments.drag import dragged
from robots import Robot, load_urdf_text
from robots.collision import Ball
from robots.inertia import mass_matrix
from robots.plant import Plant
from robots.settings import PlantSettings

SLIDE = '<limit lower="0" upper="{}" velocity="{}" effort="80"/>'


def mimic(leader: str, factor: float = 1.0, offset: float = 0.0, limit: str = "") -> str:
    limit = limit or '<limit lower="-3" upper="3" velocity="9" effort="1"/>'
    return f'{limit}<mimic joint="{leader}" multiplier="{factor}" offset="{offset}"/>'


TELESCOPE = robot(
    *map(link, ("base", "l1", "l2", "l3", "hand")),
    joint("turn", "base", "l1", axis="0 0 1"),
    joint("out", "l1", "l2", "prismatic", SLIDE.format(0.5, 1.0), "1 0 0"),
    joint("further", "l2", "l3", "prismatic", mimic("out", limit=SLIDE.format(0.4, 0.5)), "1 0 0"),
    joint("lift", "l3", "hand"),
)
PARALLELOGRAM = robot(
    *map(link, ("base", "l1", "l2", "l3", "rod", "hand")),
    joint("turn", "base", "l1", axis="0 0 1"),
    joint("arm", "l1", "l2"),
    joint("level", "l2", "l3", inside=mimic("arm", -1.0, 0.3)),
    joint("aside", "l1", "rod", inside=mimic("level", -0.5, 0.1)),
    joint("wrist", "l3", "hand", axis="1 0 0"),
)
BEFORE = robot(
    *map(link, ("base", "l1", "l2", "l3", "rod", "hand")),
    joint("turn", "base", "l1", axis="0 0 1"),
    joint("low", "l1", "l2", inside=mimic("high", -2.0, 0.3)),
    joint("high", "l2", "l3", inside='<limit lower="-1" upper="0.5" velocity="1" effort="60"/>'),
    joint("aside", "l1", "rod", inside=mimic("low", -0.5, 0.1)),
    joint("wrist", "l3", "hand", axis="1 0 0"),
)
"""A follower carries its leader, and another one comes before both in Pinocchio's order, that of names."""
ROBOTS = pytest.mark.parametrize(
    "text", [TELESCOPE, PARALLELOGRAM, BEFORE], ids=["telescope", "parallelogram", "before"]
)


def posture(arm: Robot) -> np.ndarray:
    return np.array([0.3, 0.2, -0.4])


def at(arm: Robot, frame: str, q: np.ndarray) -> pin.SE3:
    data = arm.model.createData()
    pin.framesForwardKinematics(arm.model, data, q)
    return data.oMf[arm.frame_id(frame)].copy()


def test_the_hand_of_a_telescope_moves_twice_as_far_as_its_leader() -> None:
    arm = load(TELESCOPE)
    assert arm.joint_names == ("turn", "out", "lift") and arm.n == 3 and arm.joints == (1, 2, 4)
    way = at(arm, "hand", np.array([0.0, 0.3, 0.0])).translation - at(arm, "hand", np.zeros(3)).translation
    np.testing.assert_allclose(way, (0.6, 0.0, 0.0), atol=1e-12)


def test_a_leader_keeps_the_limits_of_its_followers() -> None:
    arm = load(TELESCOPE)
    assert (arm.q_upper[1], arm.v_limit[1]) == (0.4, 0.5)
    told = " | ".join(map(str, arm.report.findings))
    assert "joint 'further': it follows 'out': 1 · q + 0" in told
    assert "joint 'out': its range is cut to [0, 0.4], so that joint 'further'" in told
    assert "joint 'out': its velocity limit is 0.5" in told


def test_a_joint_that_comes_before_its_leader_leads_it() -> None:
    """aside = 0.1 − 0.5 low and low = 0.3 − 2 high, so that high = (low − 0.3) / −2 with low = (aside −
    0.1) / −0.5: the first joint has the coordinate, and the motion is that of the file."""
    arm = load(BEFORE)
    assert arm.joint_names == ("turn", "aside", "wrist")
    told = " | ".join(map(str, arm.report.findings))
    assert "not simulated" not in told and "joint 'aside': it leads 'high', which the file says it" in told
    plain = load(BEFORE.replace("<mimic", "<other"))
    high = 0.2
    low = 0.3 - 2.0 * high
    aside = 0.1 - 0.5 * low
    values = {"turn": 0.3, "low": low, "high": high, "aside": aside, "wrist": -0.4}
    q = np.array([values[name] for name in plain.joint_names])
    for frame in ("rod", "hand"):
        moved = at(arm, frame, np.array([0.3, aside, -0.4]))
        np.testing.assert_allclose(moved.homogeneous, at(plain, frame, q).homogeneous, atol=1e-12)
    # high is in [-1, 0.5] with 1 rad/s and 60 N·m, and aside = high - 0.05.
    np.testing.assert_allclose((arm.q_lower[1], arm.q_upper[1]), (-1.05, 0.45), atol=1e-9)
    assert arm.v_limit[1] == pytest.approx(1.0) and arm.tau_limit[1] == pytest.approx(60.0)
    assert arm.n == load_urdf_text(arm.urdf_text).n


def test_a_follower_of_a_follower_has_the_factor_and_the_offset_of_both() -> None:
    arm = load(PARALLELOGRAM)
    for q in (0.0, 0.7):
        turned = [pin.log3(at(arm, frame, np.array([0.0, q, 0.0])).rotation)[1] for frame in ("l3", "rod")]
        np.testing.assert_allclose(turned, [0.3, 0.5 * q - 0.15 + 0.1], atol=1e-12)


@ROBOTS
def test_the_jacobian_is_that_of_finite_differences_in_printed_and_compiled_form(text: str) -> None:
    arm, h = load(text), 1e-6
    q = posture(arm)
    for frame in arm.frames:
        steps = [(at(arm, frame, q + step), at(arm, frame, q - step)) for step in h * np.eye(arm.n)]
        J = np.array(
            [
                (*(ahead.translation - back.translation), *pin.log3(ahead.rotation @ back.rotation.T))
                for ahead, back in steps
            ]
        ).T / (2 * h)
        printed = Configuration(arm, arm.model.createData(), q, np.zeros(arm.n)).frame_jacobians(frame)[0]
        compiled = frame_at(arm, placed(geometry(arm), q[None]), frame)
        np.testing.assert_allclose(printed, J, atol=1e-8)
        np.testing.assert_allclose(compiled.J[0], printed, atol=1e-12)
        np.testing.assert_allclose(compiled.p[0], at(arm, frame, q).translation, atol=1e-12)
        np.testing.assert_allclose(compiled.R[0], at(arm, frame, q).rotation, atol=1e-12)


@ROBOTS
def test_the_gradient_of_a_distance_is_that_of_finite_differences(text: str) -> None:
    arm, h = load(text), 1e-6
    q = posture(arm)
    model = CollisionModel(arm, (Ball("ball", (0.4, 0.7, 0.2), 0.1),))

    def distances(q: np.ndarray) -> np.ndarray:
        return model.clearances(q[None], 10.0).distance

    found = model.clearances(q[None], 10.0)
    slopes = [(distances(q + step) - distances(q - step)) / (2 * h) for step in h * np.eye(arm.n)]
    np.testing.assert_allclose(found.gradient, np.transpose(slopes), atol=1e-7)


@ROBOTS
def test_the_plant_is_that_of_the_model(text: str) -> None:
    """M, C v + g, Jacobians and accelerations are Pinocchio's, and in motion a follower stays where its
    leader puts it."""
    arm = load(text)
    q, v, tau = posture(arm), np.array([0.3, 0.2, -0.5]), np.array([3.0, 5.0, 2.0])
    plant, data = Plant(arm), arm.model.createData()
    plant.reset(q, v)
    M, bias = full_mass_matrix(arm.model, q), pin.nonLinearEffects(arm.model, data, q, v)
    np.testing.assert_allclose(plant.mass_matrix(), M, atol=1e-12)
    np.testing.assert_allclose(plant.bias(), bias, atol=1e-12)
    np.testing.assert_allclose(plant.acceleration(tau), np.linalg.solve(M, tau - bias), rtol=1e-3)
    for frame in arm.frames:
        J = pin.computeFrameJacobian(arm.model, data, q, arm.frame_id(frame), pin.LOCAL_WORLD_ALIGNED)
        np.testing.assert_allclose(plant.jacobian(frame), J, atol=1e-12)
    for k in range(400):
        plant.step(plant.holding_torque() + 2.0 * np.sin(k / 50) * np.ones(arm.n), 1e-3)
        for frame in arm.frames:
            assert np.abs(plant.frame_pose(frame)[1] - at(arm, frame, plant.q).translation).max() < 1e-6
    assert np.abs(plant.q - q).max() > 0.02
    scaled = Plant(arm, PlantSettings(diagonal_scale=1.5))
    scaled.reset(q, v)
    np.testing.assert_allclose(scaled.mass_matrix(), M + 0.5 * np.diag(np.diag(M)), atol=1e-12)


@ROBOTS
def test_the_mass_matrix_does_not_depend_on_the_posture_before(text: str) -> None:
    """Pinocchio adds to the matrix of the last call: M̄ and the rotors would be those of another robot."""
    arm = load(text)
    data, postures = arm.model.createData(), (posture(arm), 0.1 * posture(arm))
    for q in (*postures, *postures):
        found = mass_matrix(arm.model, data, q)
        np.testing.assert_allclose(found, full_mass_matrix(arm.model, q), atol=1e-12)


def test_a_telescope_follows_a_dragged_target() -> None:
    motion = dragged(load_urdf_text(TELESCOPE))
    assert motion.follows and motion.rest, str(motion)


@pytest.mark.parametrize("axis", ["1 0 0", "0 1 0"])
def test_the_segments_of_a_telescope_slide_in_one_another(axis: str) -> None:
    """Each segment has a motor of its own. Slides along different axes are no telescope."""
    tube = '<collision><geometry><box size="0.8 0.1 0.1"/></geometry></collision>'
    arm = load(
        robot(
            *(link(name, INERTIAL + tube) for name in ("base", "l1", "l2", "l3")),
            joint("turn", "base", "l1", axis="0 0 1"),
            joint("out", "l1", "l2", "prismatic", SLIDE.format(0.5, 1.0), "1 0 0"),
            joint("further", "l2", "l3", "prismatic", SLIDE.format(0.5, 1.0), axis),
        )
    )
    pairs = {pair.names for pair in arm.collision.excluded if pair.why == "neighbours"}
    assert (("l1", "l3") in pairs) is (axis == "1 0 0"), pairs


def test_placo_moves_the_hand_of_a_telescope_to_its_target() -> None:
    """A segment moves by half of the motion of the one below it, from 0.1 m on, and with the hand."""
    slide = mimic("out", 0.5, 0.1, SLIDE.format(0.5, 0.5))
    arm = load(TELESCOPE.replace(mimic("out", limit=SLIDE.format(0.4, 0.5)), slide))
    stack = (Level((FramePosition(name="hand", axes="xy"),), Q=10.0),)
    settings = HTMPCSettings(stack, rate_hz=50.0, gains=(2.0,), first_level="soft")
    controller, q, v = Placo(arm, settings), np.array([0.0, 0.2, 0.1]), np.zeros(3)
    goal = at(arm, arm.tip, np.array([0.3, 0.3, 0.1])).translation[:2]
    assert np.linalg.norm(goal - at(arm, arm.tip, q).translation[:2]) > 0.2
    preview = {"hand": Hold(goal).preview(0.0, settings.dt, settings.horizon)}
    for _ in range(300):
        plan = controller.step(q, v, preview)
        assert plan.notice is None and plan.levels[0].kkt_residual < 1e-6
        q, v = plan.motion.position(settings.period), plan.motion.velocity(settings.period)
    np.testing.assert_allclose(at(arm, arm.tip, q).translation[:2], goal, atol=1e-3)


def test_a_finger_follows_its_leader_in_the_picture() -> None:
    """A hand without an arm: the last joint of a finger bends with the first one."""
    arm = load(
        robot(
            *map(link, ("palm", "f1", "f2", "f3")),
            joint("index_q1", "palm", "f1"),
            joint("index_q2", "f1", "f2", inside=mimic("index_q1", 1.05)),
            joint("ring_q1", "palm", "f3"),
        )
    )
    assert arm.joint_names == ("index_q1", "ring_q1")
    poses = LinkPoses(arm).at(np.array([0.4, 0.0]))
    assert poses is not None and poses.shape == (4, 7)
    np.testing.assert_allclose(poses[1, 3:], (np.cos(0.41), 0.0, np.sin(0.41), 0.0), atol=1e-12)


def test_a_robot_with_followers_can_be_sent_to_another_process() -> None:
    """Pinocchio's own copy of such a model ends the process."""
    arm = load(PARALLELOGRAM)
    again = pickle.loads(pickle.dumps(arm))
    q = posture(arm)
    assert np.abs(at(arm, "rod", q).homogeneous - at(again, "rod", q).homogeneous).max() == 0.0
    np.testing.assert_array_equal(full_mass_matrix(again.model, q), full_mass_matrix(arm.model, q))


def test_the_canonical_form_gives_the_same_robot_again() -> None:
    arm = load(PARALLELOGRAM)
    again = load(arm.urdf_text)
    assert again.joint_names == arm.joint_names and again.joints == arm.joints
    q = posture(arm)
    assert np.abs(at(arm, "rod", q).homogeneous - at(again, "rod", q).homogeneous).max() < 1e-12
