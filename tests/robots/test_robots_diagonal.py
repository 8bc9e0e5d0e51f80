"""`diagonal_scale` follows Table V literally: only the diagonal of M(q) in the dynamics is changed."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from arms import full_mass_matrix
from numpy.typing import NDArray
from scipy.integrate import solve_ivp

from robots import InputError, Plant, PlantSettings, Robot, load_robot

Array = NDArray[np.float64]

TABLE_V = (0.8, 0.8, 1.2, 1.2, 0.8, 1.2, 1.2)
"""Factors of the diagonal elements, in the paper's order."""
IIWA = load_robot("iiwa14")


def altered_mass_matrix(robot: Robot, q: Array) -> Array:
    """Returns the changed matrix M'(q), computed with Pinocchio and without MuJoCo."""
    M = full_mass_matrix(robot.model, q)
    return M + np.diag((np.array(TABLE_V) - 1.0) * M.diagonal())


def test_the_acceleration_solves_the_altered_equation() -> None:
    """M'(q) q̈ + C q̇ + g = τ holds at random states, and the plant reports this M' and this bias."""
    plant = Plant(IIWA, PlantSettings(diagonal_scale=TABLE_V))
    data = IIWA.model.createData()
    rng = np.random.default_rng(3)
    for _ in range(15):
        q, v, tau = rng.uniform(-2, 2, 7), rng.normal(0, 1, 7), rng.normal(0, 5, 7)
        plant.reset(q, v)
        M, bias = altered_mass_matrix(IIWA, q), pin.nonLinearEffects(IIWA.model, data, q, v)
        np.testing.assert_allclose(plant.mass_matrix(), M, rtol=0, atol=1e-9)
        np.testing.assert_allclose(plant.bias(), bias, rtol=0, atol=1e-9)
        np.testing.assert_allclose(M @ plant.acceleration(tau) + bias, tau, rtol=0, atol=1e-9)


def test_the_motion_is_that_of_the_altered_equation() -> None:
    """0.2 s of motion agree with an independent integration of M'(q) q̈ + C q̇ + g = τ to 1e-9."""
    data = IIWA.model.createData()
    q, v = IIWA.home.copy(), np.full(7, 0.3)
    plant = Plant(IIWA, PlantSettings(diagonal_scale=TABLE_V))
    plant.reset(q, v)
    tau = plant.holding_torque() + np.array([2.0, -3.0, 1.0, 2.0, 0.05, 0.05, 0.01])

    def rate(_: float, state: Array) -> Array:
        position, velocity = state[:7], state[7:]
        bias = pin.nonLinearEffects(IIWA.model, data, position, velocity)
        return np.r_[velocity, np.linalg.solve(altered_mass_matrix(IIWA, position), tau - bias)]

    exact = solve_ivp(rate, (0.0, 0.2), np.r_[q, v], method="DOP853", rtol=1e-12, atol=1e-13).y[:, -1]
    for _ in range(200):
        plant.step(tau, 1e-3)
    assert np.abs(plant.q - q).max() > 0.05
    np.testing.assert_allclose(np.r_[plant.q, plant.v], exact, rtol=0, atol=1e-9)
    assert plant.t == pytest.approx(0.2)


def test_it_is_not_what_scaled_links_do() -> None:
    """The two possible readings of the paper's sentence, scaled diagonal and scaled link inertias, give
    different plants."""
    matrices = []
    for settings in (PlantSettings(diagonal_scale=TABLE_V), PlantSettings(inertia_scale=TABLE_V)):
        plant = Plant(IIWA, settings)
        matrices.append(plant.mass_matrix())
    assert np.abs(matrices[0] - matrices[1]).max() > 0.1


@pytest.mark.parametrize(
    "settings", [PlantSettings(), PlantSettings(friction=0.3, damping=0.1, armature=0.02)]
)
def test_our_integration_is_mujocos(settings: PlantSettings) -> None:
    """A plant whose diagonal differs by 1e-13 is integrated by our own code, and moves like the plant that
    MuJoCo integrates.

    The tolerance is 1e-8, because MuJoCo solves friction iteratively and not to rounding.
    """
    plants = [Plant(IIWA, settings), Plant(IIWA, replace(settings, diagonal_scale=1.0 + 1e-13))]
    for plant in plants:
        plant.reset(IIWA.home, np.full(7, 0.2))
        tau = plant.holding_torque() + 1.0
        plant.push(IIWA.tip, (5.0, 0.0, 0.0))
        for _ in range(100):
            plant.step(tau, 1e-3)
    np.testing.assert_allclose(plants[1].q, plants[0].q, rtol=0, atol=1e-8)
    np.testing.assert_allclose(plants[1].v, plants[0].v, rtol=0, atol=1e-8)


def test_it_can_be_switched_on_and_off_while_running() -> None:
    plant = Plant(IIWA)
    plant.reset(IIWA.home, np.full(7, 0.2))
    plain = plant.mass_matrix()
    for scale, factor in ((TABLE_V, np.array(TABLE_V)), (1.0, np.ones(7))):
        q, v, t = plant.q, plant.v, plant.t
        plant.configure(PlantSettings(diagonal_scale=scale))
        np.testing.assert_array_equal(np.r_[plant.q, plant.v, plant.t], np.r_[q, v, t])
        np.testing.assert_allclose(plant.mass_matrix().diagonal(), factor * plain.diagonal(), rtol=1e-12)


@pytest.mark.parametrize("scale", [0.0, -1.0, 11.0, float("nan"), (0.8, 1.2), "half"])
def test_scales_that_cannot_be_are_refused(scale: object) -> None:
    with pytest.raises(InputError, match=r"plant\.diagonal_scale"):
        Plant(IIWA, PlantSettings(diagonal_scale=scale))  # pyright: ignore[reportArgumentType]
