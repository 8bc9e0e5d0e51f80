"""The mechanics of the plant equal those of Pinocchio."""

from __future__ import annotations

import dataclasses

import numpy as np
import pinocchio as pin
import pytest
from arms import full_mass_matrix, joint, link
from arms import robot as urdf

from robots import CATALOG, Plant, PlantSettings, Robot, load_robot, load_urdf_text
from robots.joints import joint_axis


def independently_changed(
    robot: Robot, payload: float, scales: np.ndarray, armature: float, gravity: bool
) -> pin.Model:
    """Returns the changed mechanics without using `robots.truth`: scaled dynamic parameters and one more body
    for the payload."""
    model = robot.model.copy()
    for k in range(robot.n):
        parameters = robot.model.inertias[k + 1].toDynamicParameters()
        model.inertias[k + 1] = pin.Inertia.FromDynamicParameters(parameters * scales[k])
    frame = robot.model.frames[robot.frame_id(robot.tip)]
    model.appendBodyToJoint(
        frame.parentJoint, pin.Inertia(payload, np.zeros(3), np.zeros((3, 3))), frame.placement
    )
    model.armature = np.full(robot.n, armature)
    if not gravity:
        model.gravity = pin.Motion.Zero()
    return model


CASES = {
    "nominal": (PlantSettings(), (0.0, 1.0, 0.0, True)),
    "payload": (PlantSettings(payload_kg=2.5), (2.5, 1.0, 0.0, True)),
    "lighter": (PlantSettings(mass_scale=0.8, inertia_scale=0.8, armature=0.05), (0.0, 0.8, 0.05, True)),
    "weightless": (PlantSettings(payload_kg=1.0, gravity=False), (1.0, 1.0, 0.0, False)),
}


@pytest.mark.parametrize("case", CASES)
@pytest.mark.parametrize("name", CATALOG)
def test_mechanics_equal_pinocchio(name: str, case: str) -> None:
    robot = load_robot(name)
    settings, (payload, scale, armature, gravity) = CASES[case]
    scales = np.full(robot.n, scale)
    if case == "lighter":
        scales = np.linspace(0.7, 1.3, robot.n)
        settings = dataclasses.replace(settings, mass_scale=tuple(scales), inertia_scale=tuple(scales))
    model = independently_changed(robot, payload, scales, armature, gravity)
    data = model.createData()
    plant = Plant(robot, settings)
    rng = np.random.default_rng(7)
    for _ in range(15):
        q, v = rng.uniform(-2.5, 2.5, robot.n), rng.normal(0.0, 2.0, robot.n)
        tau = rng.normal(0.0, 5.0, robot.n)
        plant.reset(q, v)
        M = full_mass_matrix(model, q)
        np.testing.assert_allclose(plant.mass_matrix(), M, rtol=0, atol=1e-9)
        bias = pin.rnea(model, data, q, v, np.zeros(robot.n))
        np.testing.assert_allclose(plant.bias(), bias, rtol=0, atol=1e-9)
        weight = pin.rnea(model, data, q, np.zeros(robot.n), np.zeros(robot.n))
        np.testing.assert_allclose(plant.holding_torque(), weight, rtol=0, atol=1e-9)
        expected = np.linalg.solve(M, tau - bias)
        np.testing.assert_allclose(plant.acceleration(tau), expected, rtol=1e-9, atol=1e-9)
        pin.framesForwardKinematics(model, data, q)
        for frame in robot.frames:
            index = robot.frame_id(frame)
            rotation, position = plant.frame_pose(frame)
            np.testing.assert_allclose(rotation, data.oMf[index].rotation, rtol=0, atol=1e-9)
            np.testing.assert_allclose(position, data.oMf[index].translation, rtol=0, atol=1e-9)
            J = pin.computeFrameJacobian(model, data, q, index, pin.LOCAL_WORLD_ALIGNED)
            np.testing.assert_allclose(plant.jacobian(frame), J, rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", CATALOG)
def test_push_equals_external_wrench_at_the_centre_of_mass(name: str) -> None:
    robot = load_robot(name)
    plant = Plant(robot)
    force, torque = np.array([3.0, -2.0, 1.0]), np.array([0.1, 0.4, -0.3])
    q = robot.home + 0.1
    plant.reset(q)
    plant.push(robot.tip, force, torque)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, q)
    index = robot.moving_body(robot.tip)
    pose = data.oMi[index]
    about_com = pin.SE3(pose.rotation.T, robot.model.inertias[index].lever)
    wrenches = [pin.Force.Zero() for _ in range(robot.model.njoints)]
    wrenches[index] = about_com.act(pin.Force(force, torque))
    tau = plant.holding_torque()
    expected = pin.aba(robot.model, data, q, np.zeros(robot.n), tau, wrenches)
    np.testing.assert_allclose(plant.acceleration(tau), expected, atol=1e-9)
    plant.push(None)
    np.testing.assert_allclose(plant.acceleration(tau), 0.0, atol=1e-9)


def test_energy_is_kept_without_friction() -> None:
    robot = load_robot("iiwa14")
    plant = Plant(robot, PlantSettings(gravity=False))
    plant.reset(robot.home, np.full(7, 0.5), np.zeros(7))

    def energy() -> float:
        return float(0.5 * plant.v @ plant.mass_matrix() @ plant.v)

    before = energy()
    for _ in range(200):
        plant.step(np.zeros(7), 1e-3)
    assert energy() == pytest.approx(before, rel=1e-6)


def test_a_robot_from_a_urdf_with_prismatic_and_branched_joints() -> None:
    slide = joint("s", "base", "l1", "prismatic", axis="1 0 1")
    text = urdf(
        link("base"),
        link("l1"),
        link("l2"),
        link("l3"),
        slide,
        joint("a", "l1", "l2"),
        joint("b", "l1", "l3"),
    )
    robot = load_urdf_text(text)
    plant = Plant(robot)
    q = np.array([0.3, 0.5, -0.7])
    plant.reset(q)
    np.testing.assert_allclose(plant.mass_matrix(), full_mass_matrix(robot.model, q), atol=1e-9)
    with pytest.raises(ValueError, match="fixed to the world"):
        plant.push("base", (1.0, 0.0, 0.0))


@pytest.mark.parametrize("altered", [False, True])
def test_what_is_faster_than_numbers_can_follow_stays_where_it_was(altered: bool) -> None:
    """The state stays unchanged when its numbers would overflow, and the plant reports this until the next
    reset. With an altered M(q) our own integrator is the one that diverges."""
    robot = load_robot("planar3")
    plant = Plant(robot, PlantSettings(saturate=False, diagonal_scale=0.9 if altered else 1.0))
    plant.step(np.zeros(3), 1e-3)
    before = plant.q
    assert not plant.broken
    plant.step(np.full(3, 1e9), 1e-3)
    assert plant.broken
    np.testing.assert_array_equal(plant.q, before)
    np.testing.assert_array_equal(plant.v, 0.0)
    plant.step(np.zeros(3), 1e-3)
    assert np.isfinite(plant.q).all() and np.isfinite(plant.v).all()
    plant.reset(robot.home)
    assert not plant.broken


@pytest.mark.parametrize("kind", [pin.JointModelRevoluteUnaligned, pin.JointModelPrismaticUnaligned])
def test_a_joints_axis_is_read_from_no_configuration(kind: type) -> None:
    """The axis is found without a configuration vector. Pinocchio's joints do not check sizes, and a read
    past the end of a short vector once ended a process."""
    model = pin.Model()
    model.addJoint(0, kind(np.array([0.6, 0.0, 0.8])), pin.SE3.Identity(), "skew")
    model.joints[1].setIndexes(1, 10**9, 10**9)  # no configuration of this length fits into memory
    prismatic, axis = joint_axis(model, 1)
    assert prismatic == (kind is pin.JointModelPrismaticUnaligned)
    np.testing.assert_allclose(axis, [0.6, 0.0, 0.8])
