"""The adaptation of M̄ estimates the payload and keeps the limits of M̄; its effect with a payload is
tested."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc.controllers.adaptation import EVERY, LARGEST, RISE, Adaptation, LoadModel, adapted, wanted
from robots import NominalModel, load_robot
from robots.nominal import NominalSettings

Array = NDArray[np.float64]
PERIOD = 1e-3


def inertias(rng: np.random.Generator, n: int) -> tuple[Array, Array]:
    """Returns M_n, and the additional inertia of one kilogram at a point in space."""
    root, size = rng.normal(size=(n, n)), 10.0 ** rng.uniform(-1, 0, n)
    M = size[:, None] * (root @ root.T + 0.1 * np.eye(n)) * size
    J = rng.normal(size=(3, n))
    return M, J.T @ J


def largest(M: Array, M_bar: Array) -> float:
    return float(np.linalg.eigvals(np.linalg.solve(M, np.diag(M_bar))).real.max())


@pytest.mark.parametrize("seed", range(8))
def test_the_largest_eigenvalue_is_one_at_the_payload_and_less_at_a_heavier_one(seed: int) -> None:
    """With the payload, the largest eigenvalue is 1 unless LARGEST limits a joint; with a heavier payload it
    is at most 1. With links above half the nominal mass it stays below 2."""
    rng = np.random.default_rng(seed)
    n, m = int(rng.integers(1, 9)), float(rng.uniform(0.0, 6.0))
    M, Phi = inertias(rng, n)
    M_bar = np.diag(M) * rng.uniform(0.5, 1.0, n)
    found = wanted(M, Phi, m, M_bar)
    assert largest(M + m * Phi, found) <= 1.0 + 1e-9
    if (found < LARGEST * M_bar * (1 - 1e-9)).all():
        assert largest(M + m * Phi, found) == pytest.approx(1.0)
    assert (found <= LARGEST * M_bar * (1 + 1e-12)).all()
    assert largest(M + (m + 2.0) * Phi, found) <= 1.0 + 1e-9
    assert largest(0.51 * (M + m * Phi), found) < 2.0
    # The result depends on the ratios of the entries of the set value, not on their scale.
    twice = wanted(M, Phi, m, 2.0 * M_bar)
    if (found < LARGEST * M_bar * (1 - 1e-9)).all():
        np.testing.assert_allclose(twice, found)


def weighed(payload_kg: float, gravity: bool = True, ticks: int = 1000) -> list[Adaptation]:
    """Returns the states of the adaptation for an iiwa14 at rest, tick by tick."""
    robot = load_robot("iiwa14")
    model = LoadModel(robot, NominalSettings(gravity=gravity))
    tau = NominalModel(robot, NominalSettings(payload_kg=payload_kg)).bias(robot.home, np.zeros(robot.n))
    M_bar = robot.M_bar
    known = [Adaptation(M_bar)]
    for _ in range(ticks):
        known.append(adapted(known[-1], model, robot.home, tau, PERIOD, M_bar))
    return known


@pytest.mark.parametrize("payload_kg", [0.0, 0.5, 2.0, 6.0])
def test_a_payload_is_weighed(payload_kg: float) -> None:
    assert weighed(payload_kg)[-1].payload_kg == pytest.approx(payload_kg, rel=0.02, abs=1e-6)


def test_M_bar_rises_slowly() -> None:
    """M̄ starts at the set value, and per second grows by at most the share RISE."""
    M_bar = np.array([each.M_bar for each in weighed(4.0)])
    np.testing.assert_array_equal(M_bar[:EVERY], np.tile(M_bar[0], (EVERY, 1)))
    assert (M_bar[1:] / M_bar[:-1]).max() <= 1.0 + RISE * EVERY * PERIOD + 1e-12
    assert (M_bar[-1] / M_bar[0]).max() > 1.5


def test_without_gravity_no_payload_is_found() -> None:
    assert all(each.payload_kg == 0.0 for each in weighed(4.0, gravity=False, ticks=50))


# ------------------------------------------------------------------ in the loop
