"""The controller in closed loop: its levels, its robustness to any input, and its evidence."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from control_loop import holds, iiwa_settings
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc import CONTROLLERS, HIMPC, FramePosition, Joints, Level, Limits
from himpc.controllers import make_controller
from himpc.limits.limits import Avoidance
from robots import InputError, NominalSettings, Robot

Array = NDArray[np.float64]


# ------------------------------------------------------------------ the levels


def test_the_damping_level_fills_what_is_left(iiwa: Robot) -> None:
    """The damping level is added as the last level if the enabled levels leave freedom, and can be switched
    off. If they leave no freedom, it is absent."""
    previews = holds(iiwa, 5)

    def names(**changes: Any) -> list[str]:
        controller = HIMPC(iiwa, iiwa_settings(iiwa, **changes))
        return [level.name for level in controller.step(iiwa.home, np.zeros(7), previews).levels]

    stack = iiwa_settings(iiwa).stack
    # 3 + 3 + 1 rows of full rank leave no freedom to an arm with 7 joints.
    assert names() == ["position", "orientation", "q1"]
    assert names(stack=stack[:2]) == ["position", "orientation", "damping"]
    off = tuple(replace(level, enabled=False) for level in stack)
    assert names(stack=off) == ["damping"]
    assert names(stack=(off[0], stack[1], off[2])) == ["orientation", "damping"]
    assert names(stack=stack[:2], damping=False) == ["position", "orientation"]
    assert names(stack=off, damping=False) == []


# ------------------------------------------------------------------ any input


def odd_numbers(rng: np.random.Generator, size: int, kind: str) -> Array:
    values = rng.normal(0, 1, size)
    match kind:
        case "huge":
            values = values * 10 ** rng.uniform(2, 300, size)
        case "nan":
            values[rng.integers(size)] = np.nan
        case "inf":
            values[rng.integers(size)] = rng.choice([-np.inf, np.inf])
        case "tiny":
            values = values * 1e-300
    return values


kinds = st.sampled_from(["fine", "fine", "huge", "nan", "inf", "tiny"])


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@given(
    seed=st.integers(0, 2**32 - 1),
    states=st.lists(st.tuples(kinds, kinds, kinds, kinds), min_size=1, max_size=4),
    N=st.integers(1, 8),
    name=st.sampled_from(["himpc", "himpc_printed"]),
    solver=st.sampled_from(["daqp", "daqp", "daqp", "proxqp"]),
    position=st.sampled_from(["viability", "paper", "off"]),
)
@settings(max_examples=40)
def test_whatever_comes_in_the_torque_is_finite_and_in_bounds(
    iiwa: Robot, seed: int, states: list[tuple[str, ...]], N: int, name: str, solver: Any, position: Any
) -> None:
    """Random, huge or non-finite states, references and torques raise no exception."""
    rng = np.random.default_rng(seed)
    torque_scale, velocity_scale = 10 ** rng.uniform([-2, -3], [1, 2])
    limits = Limits(position=position, velocity_scale=velocity_scale, torque_scale=torque_scale)
    T_s = 10 ** rng.uniform(-4, -1.7)
    controller = make_controller(
        name,
        iiwa,
        iiwa_settings(
            iiwa,
            horizon=N,
            T_s=T_s,
            solver=solver if name == "himpc_printed" else "daqp",
            limits=limits,
            M_bar=tuple(10 ** rng.uniform(-5, 3, 7)),
            R_on=rng.choice(["torque", "acceleration"]),
        ),
    )
    bound = iiwa.tau_limit * limits.torque_scale
    controller.reset(rng.uniform(-1, 1, 7) * bound)
    for of_q, of_v, of_tau, of_reference in states:
        previews = holds(iiwa, N, T_s)
        preview = previews["position"]
        odd = odd_numbers(rng, 3, of_reference)
        previews["position"] = preview._replace(value=odd, velocity=preview.velocity + odd)
        applied = odd_numbers(rng, 7, of_tau)
        if of_tau == "fine":
            applied = rng.uniform(-1, 1, 7) * bound
        plan = controller.step(odd_numbers(rng, 7, of_q), odd_numbers(rng, 7, of_v), previews, applied)
        assert np.isfinite(plan.tau).all()
        assert (plan.tau <= plan.limits.tau_upper).all()
        assert (plan.tau >= plan.limits.tau_lower).all()
        if all(kind == "fine" for *_, kind, _ in states):
            assert (np.abs(plan.tau) <= bound * (1 + 1e-12)).all()
        assert all(np.isfinite(level.U).all() for level in plan.levels)


def test_a_state_that_is_not_finite_holds_the_torque(iiwa: Robot) -> None:
    """The plan reports the fallback "hold" and one unsolved QP. At the next finite state the controller
    starts again."""
    controller = HIMPC(iiwa, iiwa_settings(iiwa))
    tau = np.linspace(-5, 5, 7)
    controller.reset(tau)
    plan = controller.step(np.full(7, np.nan), np.zeros(7), holds(iiwa, 5))
    np.testing.assert_array_equal(plan.tau, tau)
    assert plan.levels[0].fallback == "hold"
    assert plan.unsolved == 1
    plan = controller.step(iiwa.home, np.zeros(7), holds(iiwa, 5))
    assert [level.fallback for level in plan.levels] == ["solve"] * 3


def test_the_controller_sees_no_mass(iiwa: Robot) -> None:
    """For a robot with the same geometry and different masses the torques are bitwise equal."""
    model = iiwa.model.copy()
    for k in range(1, model.njoints):
        model.inertias[k].mass *= 7.0
        model.inertias[k].lever = model.inertias[k].lever + 0.1
    model.armature = np.full(7, 3.0)
    model.gravity.linear = np.array([1.0, 2.0, 3.0])
    heavier = replace(iiwa, model=model)
    rng = np.random.default_rng(2)
    controllers = [HIMPC(robot, iiwa_settings(robot)) for robot in (iiwa, heavier)]
    previews = holds(iiwa, 5)
    for _ in range(20):
        q, v = iiwa.home + 0.1 * rng.normal(0, 1, 7), rng.normal(0, 0.3, 7)
        one, other = (controller.step(q, v, previews) for controller in controllers)
        np.testing.assert_array_equal(one.tau, other.tau)


def test_wrong_settings_change_nothing(iiwa: Robot) -> None:
    """After a refused call of `configure` the torques of the controller are bitwise unchanged."""
    one, other = HIMPC(iiwa, iiwa_settings(iiwa)), HIMPC(iiwa, iiwa_settings(iiwa))
    previews = holds(iiwa, 5)
    for _ in range(3):
        one.step(iiwa.home, np.full(7, 0.01), previews)
        other.step(iiwa.home, np.full(7, 0.01), previews)
    good = iiwa_settings(iiwa)
    bad = [
        replace(good, M_bar=good.M_bar[:-1]),
        replace(good, stack=(Level((FramePosition(name="p", frame="nowhere"),)),)),
        replace(good, stack=(Level((Joints(name="j", joints=("nothing",)),)),)),
        replace(good, stack=(Level((FramePosition(name="p"),), Q=(1.0, 2.0)),)),
        replace(good, stack=(*good.stack, Level((FramePosition(name="p"),), R=(1.0, 2.0), enabled=False))),
    ]
    for each in bad:
        with pytest.raises(InputError):
            one.configure(each)
    assert one.settings == good
    now, then = (c.step(iiwa.home + 0.01, np.zeros(7), previews) for c in (one, other))
    np.testing.assert_array_equal(now.tau, then.tau)


@pytest.mark.parametrize("name", CONTROLLERS)
def test_a_change_that_is_refused_at_its_last_part_changes_nothing(iiwa: Robot, name: str) -> None:
    """Horizon, limits and levels of the refused settings are right, and only the nominal model, which is
    prepared after them, does not fit. Settings and torques are those of a controller that was not asked."""
    good = iiwa_settings(iiwa, M_bar_adapt=True)
    one, other = (make_controller(name, iiwa, good) for _ in range(2))
    previews = holds(iiwa, 20)
    for k in range(3):
        for each in (one, other):
            each.step(iiwa.home, np.full(7, 0.01 * k), previews)
    before = one.settings
    limits = replace(good.limits, torque_scale=0.5, avoidance=Avoidance(on=True))
    wrong = replace(good, horizon=20, limits=limits, nominal=NominalSettings(armature=(0.1, 0.2)))
    if name.startswith("tdeosf"):
        wrong = replace(wrong, M_bar=good.M_bar[:-1])  # it has no nominal model
    with pytest.raises(InputError):
        one.configure(wrong)
    assert one.settings == before
    for k in range(5):
        at = iiwa.home + 0.01, np.full(7, 0.02 * k)
        now, then = (each.step(*at, previews) for each in (one, other))
        np.testing.assert_array_equal(now.tau, then.tau)


def test_a_message_about_the_nominal_model_names_it(iiwa: Robot) -> None:
    with pytest.raises(InputError, match=r"^nominal\.damping has 2 values"):
        make_controller("osf", iiwa, iiwa_settings(iiwa, nominal=NominalSettings(damping=(0.1, 0.2))))
    with pytest.raises(InputError, match=r"^nominal\.gravity is 'no'; give true or false"):
        make_controller("osf", iiwa, iiwa_settings(iiwa, nominal=NominalSettings(gravity="no")))  # pyright: ignore


# ------------------------------------------------------------------ evidence


def test_a_plan_carries_its_evidence(iiwa: Robot) -> None:
    """Each level has increments, cost, residual, time and leak; the torque is τ₀ plus the first input."""
    controller = HIMPC(iiwa, iiwa_settings(iiwa, horizon=7))
    tau_0 = np.linspace(-3, 3, 7)
    controller.reset(tau_0)
    plan = controller.step(iiwa.home + 0.02, np.zeros(7), holds(iiwa, 7))
    assert plan.q.shape == (8, 7)
    np.testing.assert_allclose(plan.tau, tau_0 + plan.levels[-1].U[0], atol=1e-12)
    for level in plan.levels:
        assert level.U.shape == (7, 7)
        assert level.cost >= 0
        assert level.kkt_residual <= 1e-6
        assert level.time_us > 0
        assert level.leak <= 1e-6
    assert plan.leak is not None
    assert set(plan.errors) == {"position", "orientation", "q1"}
    assert json.dumps(plan.unsolved) == "0"
