"""For every state, the torque of the safety filter is that of an independent QP and within its bounds, and
the filter reports when its rows cannot be satisfied."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from himpc.controllers import Settings, make_controller
from himpc.controllers.distance_filter import DistanceFilter, Filtered
from himpc.controllers.himpc_filtered import FilteredHIMPC
from himpc.limits import Limits, in_force
from himpc.limits.distance import least_rates
from himpc.limits.limits import Avoidance
from himpc.qp import solve_qp
from himpc.references import Hold
from himpc.references.outlook import Observed, Outlook
from himpc.stack import Level
from himpc.tasks import FramePosition, Posture
from himpc.tick.distances import Distances
from robots import load_robot
from robots.collision import Ball, Floor
from robots.world import Post

T_S = 1e-3
STACK = (Level((FramePosition(name="position"),)), Level((Posture(name="posture"),)))
AROUND = Observed((Floor(), Ball("ball", (0.6, 0.1, 0.5), 0.08), Post("post", (0.3, -0.25, 0.0), 0.9, 0.04)))


def keeping(torque_scale: float = 1.0) -> Settings:
    robot = load_robot("iiwa14")
    limits = Limits(torque_scale=torque_scale, avoidance=Avoidance(on=True))
    return Settings(STACK, tuple(robot.M_bar), limits=limits)


def filtered(rng: np.random.Generator, wild: float, speed: float) -> tuple[Filtered, dict[str, np.ndarray]]:
    """Returns the result of the filter for one torque at a random state, and its inputs."""
    robot = load_robot("iiwa14")
    asked = keeping()
    q = rng.uniform(robot.q_lower, robot.q_upper)
    v = speed * rng.uniform(-robot.v_limit, robot.v_limit)
    tau_0 = rng.uniform(-0.5, 0.5, robot.n) * robot.tau_limit
    wanted = tau_0 + wild * rng.normal(size=robot.n) * robot.M_bar
    force = in_force(robot, asked.limits)
    found = DistanceFilter(robot, asked)(q, v, tau_0, wanted, robot.M_bar, force, AROUND)
    return found, {"q": q, "v": v, "tau_0": tau_0, "wanted": wanted}


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 10**6), st.sampled_from([1.0, 30.0, 1e4]), st.sampled_from([0.0, 0.1, 1.0]))
def test_the_torque_is_that_of_an_independent_QP_and_within_its_bounds(
    seed: int, wild: float, speed: float
) -> None:
    """The reference is the same filter, written in τ with rows from the rates and gradients, and solved by
    another solver."""
    robot = load_robot("iiwa14")
    found, given_ = filtered(np.random.default_rng(seed), wild, speed)
    assert np.isfinite(found.tau).all()
    assert (np.abs(found.tau) <= robot.tau_limit).all()
    avoidance = Avoidance(on=True)
    near = Distances(robot, avoidance).at(given_["q"], AROUND)
    rates = least_rates(near, avoidance)
    kept = np.isfinite(rates) & (np.linalg.norm(near.gradient, axis=1) > 0.0)
    share = 15.0 * T_S
    # ∇d·(v + T_s M̄⁻¹(τ − τ₀)) ≥ ∇d·v + share (rate − ∇d·v), with q̈₀ = 0 at the first tick
    A = T_S * near.gradient[kept] / robot.M_bar
    lower = share * (rates[kept] - near.gradient[kept] @ given_["v"]) + A @ given_["tau_0"]
    if not found.met:
        assert found.active.slack.max() > 0.0
        return
    assert (A @ found.tau - lower >= -1e-7).all()
    W = np.diag(robot.M_bar**-2.0)
    other = solve_qp(
        W,
        -W @ np.clip(given_["wanted"], -robot.tau_limit, robot.tau_limit),
        np.vstack([A / T_S, np.eye(robot.n)]),
        np.concatenate([lower / T_S, -robot.tau_limit]),
        np.concatenate([np.full(len(A), np.inf), robot.tau_limit]),
        "proxqp",
    )
    assert found.tau == pytest.approx(other.x, abs=1e-3)


def test_rows_that_cannot_be_met_give_way_by_least_squares_and_say_so() -> None:
    """An arm falls onto the floor with two thousandths of its torque and cannot brake as much as the rows
    require. The sum of squared violations is the least possible, and each violation is reported with its
    pair."""
    robot = load_robot("iiwa14")
    asked = keeping(torque_scale=0.002)
    q = robot.home.copy()
    q[1], q[3] = 1.6, -0.4
    v = np.zeros(robot.n)
    v[1], v[3] = 3.0 * robot.v_limit[1], 3.0 * robot.v_limit[3]
    force, tau_0 = in_force(robot, asked.limits), np.zeros(robot.n)
    found = DistanceFilter(robot, asked)(q, v, tau_0, tau_0, robot.M_bar, force, AROUND)
    assert not found.met
    assert found.active.slack.max() > 0.1
    told = found.active.labelled(found.rows, robot.joint_names)
    assert any(label == "distance" and "floor" in name for label, _, name, _, _ in told)
    directions = found.rows.directions_of(1)
    assert directions is not None
    kept = np.isfinite(found.rows.lower[1])
    D, lower = directions.D[kept], found.rows.lower[1, kept]

    def missed(tau: np.ndarray) -> float:
        return float((np.maximum(lower - D @ (tau - tau_0), 0.0) ** 2).sum())

    least, rng = missed(found.tau), np.random.default_rng(1)
    for _ in range(300):
        near = np.clip(found.tau + 0.3 * rng.normal(size=robot.n), force.tau_lower, force.tau_upper)
        assert missed(near) >= least - 1e-6 * least


@pytest.mark.parametrize("wanted", [keeping(), replace(keeping(), horizon=6)])
def test_settings_that_are_given_back_keep_the_filter(wanted: Settings) -> None:
    """`settings` returns what was given. A change of another setting therefore leaves the filter on."""
    robot = load_robot("iiwa14")
    controller = make_controller("himpc_filtered", robot, wanted)
    assert controller.settings == wanted
    controller.configure(replace(controller.settings, horizon=7))
    references = {"position": Hold(np.array([0.5, 0.2, 0.4])), "posture": Hold(robot.home)}
    ahead = Outlook(references, 0.0, T_S, 7, AROUND)
    assert controller.step(robot.home, np.zeros(robot.n), ahead, np.zeros(robot.n)).behind is not None
    off = Limits(avoidance=Avoidance(on=False))
    controller.configure(replace(controller.settings, limits=off))
    assert controller.step(robot.home, np.zeros(robot.n), ahead, np.zeros(robot.n)).behind is None


def test_without_distances_it_is_himpc_and_a_state_that_is_not_finite_holds_the_torque() -> None:
    robot = load_robot("iiwa14")
    off = Settings(STACK, tuple(robot.M_bar))
    references = {"position": Hold(np.array([0.5, 0.2, 0.4])), "posture": Hold(robot.home)}
    plans = []
    for name in ("himpc", "himpc_filtered"):
        controller = make_controller(name, robot, off)
        controller.reset(np.zeros(robot.n))
        ahead = Outlook(references, 0.0, T_S, off.horizon)
        plans.append(controller.step(robot.home, np.zeros(robot.n), ahead, np.zeros(robot.n)).tau)
    assert np.array_equal(*plans)
    controller = make_controller("himpc_filtered", robot, keeping())
    assert isinstance(controller, FilteredHIMPC)
    controller.reset(np.full(robot.n, 1.0))
    ahead = Outlook(references, 0.0, T_S, off.horizon, AROUND)
    for q in (np.full(robot.n, np.nan), np.full(robot.n, 1e8), robot.home):
        plan = controller.step(q, np.zeros(robot.n), ahead, np.full(robot.n, 1.0))
        assert np.isfinite(plan.tau).all()
