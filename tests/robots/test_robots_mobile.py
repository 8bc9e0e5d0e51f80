"""The mobile manipulator of the catalog, its velocity servos, and its distances to obstacles are tested."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from scipy.optimize import minimize

from robots import InputError, Plant, VelocityPlant, VelocityPlantSettings, load_robot, load_urdf_text
from robots.collision import Ball, Box
from robots.robot import Robot

_DH = (  # d, a, α of the UR10, m and rad: Universal Robots, kinematic parameters
    (0.1273, 0.0, np.pi / 2),
    (0.0, -0.612, 0.0),
    (0.0, -0.5723, 0.0),
    (0.163941, 0.0, np.pi / 2),
    (0.1157, 0.0, -np.pi / 2),
    (0.0922, 0.0, 0.0),
)


@pytest.fixture(scope="module")
def robot() -> Robot:
    return load_robot("ridgeback-ur10")


def tool(robot: Robot, q: np.ndarray) -> np.ndarray:
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    return data.oMf[robot.frame_id("tool")].translation.copy()


def by_denavit_hartenberg(q: np.ndarray) -> np.ndarray:
    """Returns the position of the tool, computed only from the parameters of the base, the mount, the six
    joints and the tool."""
    x, y, yaw = q[:3]
    T = pin.SE3(pin.rpy.rpyToMatrix(0, 0, yaw), np.array([x, y, 0.0]))
    T = T * pin.SE3(pin.rpy.rpyToMatrix(0, 0, np.pi / 2), np.array([0.27, 0.01, 0.666]))
    for angle, (d, a, alpha) in zip(q[3:], _DH, strict=True):
        turn = pin.SE3(pin.rpy.rpyToMatrix(0, 0, angle), np.array([0, 0, d]))
        T = T * turn * pin.SE3(pin.rpy.rpyToMatrix(alpha, 0, 0), np.array([a, 0, 0]))
    return T.act(np.array([0, 0, 0.29]))


def test_tool_follows_the_arms_denavit_hartenberg_parameters(robot: Robot) -> None:
    np.testing.assert_allclose(tool(robot, robot.home), [1.490, 0.174, 0.705], atol=1e-3)
    rng = np.random.default_rng(0)
    for _ in range(20):
        q = rng.uniform(-3.0, 3.0, 9)
        np.testing.assert_allclose(tool(robot, q), by_denavit_hartenberg(q), atol=1e-9)


def test_horizontal_reach(robot: Robot) -> None:
    """The reach is the largest horizontal distance of the tool from the centre of the base, with the tool at
    the height that it has at home."""
    height = tool(robot, robot.home)[2]

    def away(arm: np.ndarray) -> np.ndarray:
        return tool(robot, np.concatenate([np.zeros(3), arm]))

    best = 0.0
    for seed in range(6):
        start = np.random.default_rng(seed).uniform(robot.q_lower[3:], robot.q_upper[3:])
        found = minimize(
            lambda arm: -float(np.hypot(*away(arm)[:2])),
            start,
            method="SLSQP",
            bounds=list(zip(robot.q_lower[3:], robot.q_upper[3:], strict=True)),
            constraints={"type": "eq", "fun": lambda arm: away(arm)[2] - height},
        )
        best = max(best, -found.fun if found.success else 0.0)
    assert best == pytest.approx(1.86, abs=0.01)


def test_base_moves_along_world_axes_whatever_its_heading(robot: Robot) -> None:
    q = robot.home.copy()
    q[:3] = 1.0, -2.0, 2.3
    J = pin.computeFrameJacobian(
        robot.model, robot.model.createData(), q, robot.frame_id("base"), pin.LOCAL_WORLD_ALIGNED
    )
    expected = np.zeros((6, 9))
    expected[0, 0] = expected[1, 1] = expected[5, 2] = 1.0
    np.testing.assert_allclose(J, expected, atol=1e-12)


def test_limits_of_the_authors_set_up(robot: Robot) -> None:
    np.testing.assert_allclose(robot.v_limit, [1.1, 1.1, 2, 2, 2, 3, 3, 3, 3])
    np.testing.assert_allclose(robot.a_max, [2.5, 2.5, 1, 2.16, 2.16, 3.15, 3.2, 3.2, 3.2])
    np.testing.assert_allclose(robot.q_lower[3:], [0, *[-np.pi] * 5])
    np.testing.assert_allclose(robot.q_upper[3:], np.pi)
    assert np.isinf(robot.q_upper[:3]).all()


def test_plant_agrees_with_pinocchio(robot: Robot) -> None:
    plant = Plant(robot)
    rng = np.random.default_rng(1)
    q, v = rng.uniform(-1, 1, (2, 9))
    plant.reset(q, v)
    data = robot.model.createData()
    M = np.triu(pin.crba(robot.model, data, q))
    np.testing.assert_allclose(plant.mass_matrix(), M + np.triu(M, 1).T, atol=1e-9)
    np.testing.assert_allclose(plant.frame_pose("tool")[1], tool(robot, q), atol=1e-9)


def command(t: float) -> np.ndarray:
    return np.array([0.5, -0.3, 0.2, 0.4, -0.3, 0.2, 0.1, 0.0, 0.2]) * np.sin(2.0 * t)


def driven(plant: VelocityPlant, seconds: float, h: float = 0.01) -> np.ndarray:
    """Returns, for every step, the largest difference of a joint between v and the command."""
    gaps = []
    for _ in range(round(seconds / h)):
        wanted = command(plant.t + h)
        plant.step(wanted, h)
        gaps.append(np.abs(plant.v - wanted).max())
    return np.array(gaps)


def test_ideal_kinematics_are_the_double_integrator(robot: Robot) -> None:
    """If the commands are samples of constant accelerations, positions follow q + vh + ½uh², and velocities
    are exact."""
    plant = VelocityPlant(robot)
    q, v = robot.home.copy(), np.zeros(9)
    rng = np.random.default_rng(2)
    for _ in range(20):
        u = rng.uniform(-1, 1, 9)
        for k in range(10):
            plant.step(v + u * 0.01 * (k + 1), 0.01)
        q, v = q + 0.1 * v + 0.005 * u, v + 0.1 * u
    np.testing.assert_allclose(plant.q, q, atol=1e-12)
    np.testing.assert_allclose(plant.v, v, atol=1e-12)
    assert plant.tau is None
    assert plant.t == pytest.approx(2.0)


def test_servo_tracks_better_with_more_bandwidth(robot: Robot) -> None:
    slow, fast = (
        driven(VelocityPlant(robot, VelocityPlantSettings(mode="servo", bandwidth=bandwidth)), 1.5)[50:].max()
        for bandwidth in (20.0, 200.0)
    )
    assert fast < 0.012
    assert 4.0 * fast < slow < 0.1


def test_lag_and_delay_act_in_both_modes(robot: Robot) -> None:
    """After a step of the command the velocity is zero during the delay, and then 1 − e^(−t/lag) of the
    command."""
    wanted = np.full(9, 0.1)
    for mode in ("ideal", "servo"):
        settings = VelocityPlantSettings(mode=mode, bandwidth=300.0, lag_ms=50.0, delay_ms=40.0)
        plant = VelocityPlant(robot, settings)
        plant.step(wanted, 0.039)
        assert np.abs(plant.v).max() < 1e-6
        plant.step(wanted, 0.051)
        lost = 0.004 if mode == "servo" else 0.0
        np.testing.assert_allclose(plant.v, 0.1 * (1 - np.exp(-1.0)) - lost, atol=0.004)


def test_noise_is_seeded_and_only_in_the_measurement(robot: Robot) -> None:
    settings = VelocityPlantSettings(position_noise=1e-3, velocity_noise=1e-2)

    def run(seed: int) -> tuple[np.ndarray, np.ndarray]:
        plant = VelocityPlant(robot, settings, seed)
        seen = []
        for _ in range(200):
            plant.step(np.zeros(9), 0.01)
            state = plant.measure()
            np.testing.assert_array_equal(state.q, plant.measure().q)
            seen.append(state.q)
        return np.array(seen), plant.q

    seen, true = run(1)
    np.testing.assert_array_equal(true, robot.home)
    np.testing.assert_array_equal(seen, run(1)[0])
    assert not np.array_equal(seen, run(2)[0])
    assert np.std(seen - true) == pytest.approx(1e-3, rel=0.1)


def test_plant_can_change_while_it_moves(robot: Robot) -> None:
    plant = VelocityPlant(robot)
    driven(plant, 0.5)
    before = plant.t, plant.q, plant.v
    plant.configure(VelocityPlantSettings(mode="servo"))
    np.testing.assert_array_equal(plant.q, before[1])
    np.testing.assert_array_equal(plant.v, before[2])
    assert plant.t == before[0]
    plant.step(plant.v, 0.01)
    assert np.abs(plant.v - before[2]).max() < 0.02
    with pytest.raises(InputError, match=r"friction has 2 values"):
        plant.configure(VelocityPlantSettings(mode="servo", friction=(1.0, 2.0)))
    assert plant.settings.friction == 0.0


def test_wrong_plant_settings_name_the_field(robot: Robot) -> None:
    for field, value in (
        ("bandwidth", 0.0),
        ("lag_ms", np.nan),
        ("position_noise", -1.0),
        ("payload_kg", -1),
    ):
        with pytest.raises(InputError, match=field):
            replace(VelocityPlantSettings(), **{field: value})
    with pytest.raises(InputError, match="did you mean 'servo'"):
        VelocityPlantSettings(mode="servos")  # pyright: ignore[reportArgumentType]
    with pytest.raises(ValueError, match="9 finite numbers"):
        VelocityPlant(robot).step(np.full(9, np.nan), 0.01)


def test_planar_and_floating_bases_are_refused_in_one_sentence() -> None:
    """A base that is a single joint of several coordinates, such as a unicycle's, is welded; then nothing
    moves here. Further up the tree such a joint is refused by its name."""
    for kind in ("planar", "floating"):
        text = f"""<robot name="cart"><link name="world"/><link name="cart"><inertial><mass value="1"/>
        <inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="1"/></inertial></link>
        <joint name="base" type="{kind}"><parent link="world"/><child link="cart"/></joint></robot>"""
        with pytest.raises(InputError) as refused:
            load_urdf_text(text)
        assert "none of its joints moves" in str(refused.value)
        assert "floating base" in str(refused.value)
        assert str(refused.value).count("\n") == 0
        turns = """<link name="ground"/><joint name="turn" type="revolute"><parent link="ground"/>
        <child link="world"/><limit lower="-1" upper="1" effort="1" velocity="1"/></joint></robot>"""
        with pytest.raises(InputError, match=f"joint 'base': a {kind} joint has several axes"):
            load_urdf_text(text.replace("</robot>", turns))


def test_wrong_obstacles_are_named() -> None:
    with pytest.raises(InputError, match="'egg'"):
        Ball("egg", (0.0, 0.0, 0.0), 0.0)
    with pytest.raises(InputError, match="'crate'"):
        Box("crate", (0.0, np.nan, 0.0), (1.0, 1.0, 1.0))
