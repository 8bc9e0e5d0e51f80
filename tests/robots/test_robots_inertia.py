"""The suggested M̄ gives convergence at all configurations, and the gauge shows an M̄ without convergence."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pinocchio as pin
import pytest
from arms import full_mass_matrix
from hypothesis import given, settings
from hypothesis import strategies as st

from robots import CATALOG, convergence_gauge, load_robot, suggest_M_bar
from robots.inertia import finite_range, sensible_payload


@pytest.mark.parametrize("name", CATALOG)
def test_suggestion_is_stable_at_unseen_configurations(name: str) -> None:
    robot = load_robot(name)
    M_bar = suggest_M_bar(robot.model, robot.q_lower, robot.q_upper, 200)
    rng = np.random.default_rng(99)
    for _ in range(100):
        q = rng.uniform(*finite_range(robot.q_lower, robot.q_upper))
        assert convergence_gauge(full_mass_matrix(robot.model, q), M_bar)[1] < 1.0


@pytest.mark.parametrize("name", CATALOG)
def test_catalog_M_bar_is_stable_at_home(name: str) -> None:
    """Every M̄ of the catalog is stable at home; that of the planar arm needs the rotor inertia that its
    scenes give to the plant."""
    robot = load_robot(name)
    rotors = np.array([0.05, 0.05, 0.03]) if name == "planar3" else np.zeros(robot.n)
    M = full_mass_matrix(robot.model, robot.home) + np.diag(rotors)
    assert convergence_gauge(M, robot.M_bar)[1] < 1.0


def test_iiwa_gauge_at_the_papers_configuration() -> None:
    """At the paper's M̄ the spectral radius is below 1, but the norm is not."""
    robot = load_robot("iiwa14")
    M = full_mass_matrix(robot.model, np.radians([0, 60, 0, 60, 0, 0, 0]))
    norm, radius = convergence_gauge(M, robot.M_bar)
    assert norm == pytest.approx(1.0325, abs=0.002)
    assert radius == pytest.approx(0.956, abs=0.005)


@settings(max_examples=50, deadline=None)
@given(st.integers(1, 8), st.integers(0, 10_000))
def test_gauge_equals_its_definition(n: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    A = rng.normal(size=(n, n))
    M, M_bar = A @ A.T + 0.5 * np.eye(n), rng.uniform(0.05, 3.0, n)
    error = np.eye(n) - np.linalg.inv(M) @ np.diag(M_bar)
    norm, radius = convergence_gauge(M, M_bar)
    assert norm == pytest.approx(np.linalg.norm(error, 2), rel=1e-8)
    assert radius == pytest.approx(np.abs(np.linalg.eigvals(error)).max(), rel=1e-8)


def test_suggestion_is_deterministic_and_copes_with_unbounded_joints() -> None:
    robot = load_robot("planar3")
    free = np.full(3, np.inf)
    first, second = (suggest_M_bar(robot.model, -free, free, 50) for _ in range(2))
    np.testing.assert_array_equal(first, second)
    assert np.all(first > 0.0)


@pytest.mark.parametrize("name", CATALOG)
def test_a_robot_holds_three_times_its_payload(name: str) -> None:
    """The robots of the catalog get 3 kg. One whose motors are weaker gets what three times of it can be
    held, by gravity computed with the mass at the hand."""
    robot = load_robot(name)
    frame = robot.model.frames[robot.frame_id(robot.tip)]
    gravity = pin.computeGeneralizedGravity(robot.model, robot.model.createData(), robot.home)
    weak = replace(robot, tau_limit=np.abs(gravity) + 1e-3 * robot.tau_limit)
    found = [
        sensible_payload(each.model, each.frame_id(each.tip), each.home, each.tau_limit, 3.0)
        for each in (robot, weak)
    ]
    assert found[0] == 3.0
    loaded = robot.model.copy()
    loaded.appendBodyToJoint(
        frame.parentJoint, pin.Inertia(3.0 * found[1], np.zeros(3), np.zeros((3, 3))), frame.placement
    )
    with_mass = pin.computeGeneralizedGravity(loaded, loaded.createData(), robot.home)
    assert (np.abs(with_mass) <= weak.tau_limit + 1e-9).all()
    assert name == "planar3" or 1e-3 <= found[1] < 3.0  # gravity does not act on its joints


def test_a_light_arm_gets_at_most_half_its_mass() -> None:
    """The file of a teaching arm of 0.6 kg gives 35 N m to each joint, for which it was offered 3 kg."""
    robot = load_robot("panda")
    light = robot.model.copy()
    for joint in range(1, light.njoints):
        light.inertias[joint] = pin.Inertia(0.08, np.zeros(3), 1e-4 * np.eye(3))
    found = sensible_payload(light, robot.frame_id(robot.tip), robot.home, robot.tau_limit, 3.0)
    assert found == pytest.approx(0.2) and found <= 0.5 * 0.08 * robot.n
