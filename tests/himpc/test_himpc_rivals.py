"""OSF, TDEOSF and HQP agree with independent evaluations of their laws, and are robust to invalid input."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import cache
from typing import Any, NamedTuple

import numpy as np
import pinocchio as pin
import pytest
from numpy.typing import NDArray

from himpc import FrameOrientation, FramePosition, Joints, Level, Settings
from himpc.controllers import Controller, hqp, make_controller
from himpc.kinematics.configuration import Configuration
from himpc.limits import Limits
from himpc.qp import QPSolution
from himpc.references import Preview
from himpc.rotation import log3
from robots import InputError, NominalModel, NominalSettings, Robot, load_robot

Array = NDArray[np.float64]

MODEL_BASED = ("osf", "osf_damped", "hqp")
RIVALS = (*MODEL_BASED, "tdeosf", "tdeosf_damped")
HEAVY = NominalSettings(payload_kg=3.0, damping=0.4, armature=0.2, inertia_scale=1.3, gravity=False)


@cache
def robot(name: str = "iiwa14") -> Robot:
    return load_robot(name)


def stack() -> tuple[Level, ...]:
    return (
        Level((FramePosition(name="position"),)),
        Level((FrameOrientation(name="orientation"),)),
        Level((Joints(name="q1", joints=robot().joint_names[:1]),)),
    )


def settings(**changes: Any) -> Settings:
    return Settings(**({"stack": stack(), "M_bar": tuple(robot().M_bar)} | changes))


class Moment(NamedTuple):
    """A regular state of the moving iiwa, and moving references."""

    q: Array
    v: Array
    previews: dict[str, Preview]


def moment(seed: int) -> Moment:
    rng = np.random.default_rng(seed)
    arm = robot()
    q, v = arm.home + rng.uniform(-0.3, 0.3, 7), rng.uniform(-1.0, 1.0, 7)
    tip = Configuration(arm, arm.model.createData(), q, v).placement()
    turn = pin.exp3(rng.normal(0, 0.05, 3))
    values = {
        "position": tip.translation + rng.normal(0, 0.02, 3),
        "orientation": turn @ tip.rotation,
        "q1": q[:1] + rng.normal(0, 0.1, 1),
    }
    previews = {}
    for name, value in values.items():
        m = 1 if name == "q1" else 3
        drawn = rng.normal(0, 0.3, (2, 6, m))
        previews[name] = Preview(value, np.zeros((6, m)), drawn[0], drawn[1])
    return Moment(q, v, previews)


def demands(at: Moment) -> list[tuple[Array, Array]]:
    """Returns J_i and ẍ_id − K_v ẋ̃ − K_p x̃ − J̇_i q̇ of the three levels, with J̇q̇ from Pinocchio's
    forward kinematics."""
    model, data = robot().model, robot().model.createData()
    index, axes = robot().frame_id(robot().tip), pin.LOCAL_WORLD_ALIGNED
    pin.forwardKinematics(model, data, at.q, at.v, np.zeros(7))
    pin.updateFramePlacements(model, data)
    drift = pin.getFrameClassicalAcceleration(model, data, index, axes)
    J = pin.computeFrameJacobian(model, data, at.q, index, axes)
    pin.forwardKinematics(model, data, at.q, at.v, np.zeros(7))
    placement = data.oMf[index]
    found = []
    for name, rows, K_p, K_v, bias in (
        ("position", J[:3], 200.0, 10.0, drift.linear),
        ("orientation", J[3:], 50.0, 5.0, drift.angular),
        ("q1", np.eye(7)[:1], 50.0, 5.0, np.zeros(1)),
    ):
        preview = at.previews[name]
        error = {
            "position": lambda p: placement.translation - p.value,
            "orientation": lambda p: log3(placement.rotation @ p.value.T),
            "q1": lambda p: at.q[:1] - p.value,
        }[name](preview)
        rate = rows @ at.v - preview.velocity[0]
        found.append((rows, preview.acceleration[0] - K_v * rate - K_p * error - bias))
    return found


def operational_space(M: Array, levels: list[tuple[Array, Array]]) -> list[Array]:
    """Returns Σ_p J_{p|prec}ᵀ Λ_{p|prec} (…) with explicit inverses, as the references print it."""
    n = len(M)
    inverse = np.linalg.inv(M)
    N, tau, found = np.eye(n), np.zeros(n), []
    for J, wanted in levels:
        projected = J @ N
        Lambda = np.linalg.inv(projected @ inverse @ projected.T)
        tau = tau + projected.T @ Lambda @ (wanted - J @ inverse @ tau)
        N = N @ (np.eye(n) - inverse @ projected.T @ Lambda @ projected)
        found.append(tau)
    return found


# ------------------------------------------------------------------ the laws


@pytest.mark.parametrize("seed", range(5))
def test_osf_is_the_operational_space_law(seed: int) -> None:
    """The torque of every level equals that of the printed recursion with explicit Λ and null-space
    projectors."""
    at = moment(seed)
    nominal = NominalSettings(inertia_scale=0.8, armature=0.1, damping=0.2)
    plan = make_controller("osf", robot(), settings(nominal=nominal)).step(
        at.q, at.v, at.previews, np.ones(7)
    )
    model = NominalModel(robot(), nominal)
    bias = model.bias(at.q, at.v)
    expected = operational_space(model.mass_matrix(at.q), demands(at))
    for level, torque in zip(plan.levels, expected, strict=True):
        np.testing.assert_allclose(level.U[0] + 1.0, bias + torque, rtol=1e-5, atol=1e-4)
    np.testing.assert_allclose(plan.tau, bias + expected[-1], rtol=1e-5, atol=1e-4)
    assert [level.fallback for level in plan.levels] == ["solve"] * 3
    assert all(np.isnan(level.kkt_residual) for level in plan.levels)


@pytest.mark.parametrize("seed", range(3))
def test_tdeosf_is_the_same_law_with_time_delay_estimation(seed: int) -> None:
    """τ = τ₀ − M̄ q̈₀ + the law with M̄; q̈₀ is the backward difference of q̇ and zero at the first tick."""
    at = moment(seed)
    M_bar = np.array(robot().M_bar)
    law = operational_space(np.diag(M_bar), demands(at))[-1]
    controller = make_controller("tdeosf", robot(), settings())
    tau_0 = np.linspace(-3.0, 3.0, 7)
    first = controller.step(at.q, at.v, at.previews, tau_0)
    np.testing.assert_allclose(first.tau, tau_0 + law, rtol=1e-6, atol=1e-6)
    faster = at._replace(v=at.v + 0.01)
    second = controller.step(at.q, faster.v, at.previews, first.tau)
    law = operational_space(np.diag(M_bar), demands(faster))[-1]
    np.testing.assert_allclose(second.tau, first.tau - M_bar * 0.01 / 1e-3 + law, rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("name", ["osf", "hqp"])
def test_an_exact_model_gives_the_accelerations_asked_for(name: str) -> None:
    """With the exact model, all levels of a regular arm have the acceleration that (4) demands; the effect of
    a small R in HQP is negligible."""
    at = moment(1)
    R = 1e-6 if name == "hqp" else 10.0
    levels = tuple(replace(level, R=R) for level in stack())
    plan = make_controller(name, robot(), settings(stack=levels, limits=Limits(torque=False))).step(
        at.q, at.v, at.previews
    )
    model = NominalModel(robot(), NominalSettings())
    acceleration = np.linalg.solve(model.mass_matrix(at.q), plan.tau - model.bias(at.q, at.v))
    for J, wanted in demands(at):
        np.testing.assert_allclose(J @ acceleration, wanted, atol=2e-3 * np.abs(wanted).max())


@pytest.mark.parametrize("name", RIVALS)
def test_lower_levels_leave_the_first_alone(name: str) -> None:
    """In the controller's own model the acceleration of level 1 does not depend on the levels below."""
    at = moment(2)
    wild = dict(at.previews)
    wild["orientation"] = Preview(
        at.previews["orientation"].value, np.zeros((6, 3)), np.full((6, 3), 9.0), np.full((6, 3), 99.0)
    )
    model = NominalModel(robot(), NominalSettings())
    M = np.diag(robot().M_bar) if name.startswith("tdeosf") else model.mass_matrix(at.q)
    J = demands(at)[0][0]
    plans = [make_controller(name, robot(), settings()).step(at.q, at.v, p) for p in (at.previews, wild)]
    assert np.abs(plans[0].tau - plans[1].tau).max() > 1.0
    moved = J @ np.linalg.solve(M, plans[0].tau - plans[1].tau)
    assert np.abs(moved).max() < 1e-9 * np.abs(np.linalg.solve(M, plans[0].tau - plans[1].tau)).max()
    assert max(plan.leak or 0.0 for plan in plans) < 1e-9


@pytest.mark.parametrize(
    ("solver", "share"), [("daqp", 1.0), ("daqp", 0.1), ("daqp", 0.04), ("proxqp", 1.0), ("proxqp", 0.1)]
)
def test_hqp_meets_its_kkt_conditions(solver: Any, share: float) -> None:
    """The KKT conditions hold in the full torque space: gradient + multipliers of the bounds ∈ row space of
    the levels above."""
    at = moment(3)
    chosen = settings(limits=Limits(torque_scale=share), solver=solver)
    controller = make_controller("hqp", robot(), chosen)
    plan = controller.step(at.q, at.v, at.previews)
    model = NominalModel(robot(), NominalSettings())
    M, bias = model.mass_matrix(at.q), model.bias(at.q, at.v)
    limit = share * robot().tau_limit
    above, previous = np.empty((0, 7)), np.zeros(7)
    bound = 0
    for level, (J, wanted), form in zip(plan.levels, demands(at), stack(), strict=True):
        B = J @ np.linalg.inv(M)
        tau = level.U[0] + plan.tau_0
        y = tau - bias
        multipliers = np.zeros(7)
        multipliers[level.active.joint] = level.active.multiplier
        assert (np.abs(tau) <= limit + 1e-8).all()
        pressed = multipliers != 0
        np.testing.assert_allclose(tau[pressed], np.sign(multipliers[pressed]) * limit[pressed], atol=1e-6)
        bound += int(pressed.sum())
        gradient = 200.0 * B.T @ (B @ y - wanted) + 10.0 * y + multipliers
        if len(above):
            gradient -= above.T @ np.linalg.lstsq(above.T, gradient, rcond=None)[0]
            assert np.abs(above @ (y - previous)).max() < 1e-7
        assert np.abs(gradient).max() < 1e-5 * max(1.0, float(np.abs(200.0 * B.T @ wanted).max()))
        assert level.kkt_residual <= 1e-6 and form.name == level.name
        above, previous = np.vstack([above, B]), y
    assert (bound > 0) == (share < 1.0)


# ------------------------------------------------------------------ the models that they use


# ------------------------------------------------------------------ singular, failing, not finite


def test_a_failing_qp_is_data(monkeypatch: pytest.MonkeyPatch) -> None:
    """Without a verified point level 1 brakes within the bounds and the other levels inherit its torque; no
    exception is raised."""
    nothing = QPSolution(np.full(7, np.nan), np.zeros(7), float("inf"), "no idea", 1.0)
    monkeypatch.setattr(hqp, "solve_qp", lambda *_: nothing)
    at = moment(4)
    plan = make_controller("hqp", robot(), settings()).step(at.q, 40.0 * at.v, at.previews)
    assert plan.unsolved == 3
    assert [level.fallback for level in plan.levels] == ["brake", "inherit", "inherit"]
    assert {level.status for level in plan.levels} == {"no idea"}
    assert (np.abs(plan.tau) <= robot().tau_limit).all()
    assert (np.abs(plan.tau) == robot().tau_limit).any()


@pytest.mark.parametrize("name", RIVALS)
def test_an_unusable_state_holds_the_torque(name: str) -> None:
    """For NaN, infinite or huge states and references the last torque is held; the controller continues at
    the next valid tick."""
    at = moment(5)
    controller = make_controller(name, robot(), settings())
    good = controller.step(at.q, at.v, at.previews)
    lost = dict(at.previews)
    lost["q1"] = Preview(np.array([np.nan]), *(np.zeros((6, 1)) for _ in range(3)))
    for q, v, previews in (
        (at.q * np.nan, at.v, at.previews),
        (at.q, at.v + np.inf, at.previews),
        (at.q, at.v * 1e12, at.previews),
        (at.q, at.v, lost),
    ):
        plan = controller.step(q, v, previews)
        np.testing.assert_array_equal(plan.tau, good.tau)
        assert plan.levels[0].fallback == "hold" and plan.unsolved == 1
    after = controller.step(at.q, at.v, at.previews, good.tau)
    assert np.isfinite(after.tau).all() and after.unsolved == 0


@pytest.mark.parametrize("name", RIVALS)
@pytest.mark.parametrize("speed", [1e2, 1e5, 1e8])
def test_a_racing_robot_gets_a_finite_torque(name: str, speed: float) -> None:
    at = moment(6)
    plan = make_controller(name, robot(), settings()).step(at.q, speed * at.v, at.previews)
    assert np.isfinite(plan.tau).all()


# ------------------------------------------------------------------ settings that change


BAD: dict[str, Callable[[], Settings]] = {
    "M_bar has 6 entries": lambda: settings(M_bar=tuple(robot().M_bar[:6])),
    "K_p of task 'position' has 2": lambda: settings(
        stack=(Level((FramePosition(name="position", K_p=(1.0, 2.0)),)),)
    ),
    "R of level 'position' has 2": lambda: settings(
        stack=(Level((FramePosition(name="position"),), R=(1.0, 2.0), enabled=False), *stack()[1:])
    ),
    "frame of robot": lambda: settings(stack=(Level((FramePosition(name="position", frame="nose"),)),)),
}


@pytest.mark.parametrize("name", RIVALS)
@pytest.mark.parametrize("message", BAD)
def test_wrong_settings_are_refused_and_change_nothing(name: str, message: str) -> None:
    """An InputError names the field, and the next torque equals that of a second controller that was not
    changed."""
    at = moment(7)
    controller, twin = (make_controller(name, robot(), settings()) for _ in range(2))
    for each in (controller, twin):
        each.step(at.q, at.v, at.previews)
    before = controller.settings
    with pytest.raises(InputError, match=message):
        controller.configure(BAD[message]())
    assert controller.settings is before
    np.testing.assert_array_equal(
        controller.step(at.q, at.v + 1e-3, at.previews).tau, twin.step(at.q, at.v + 1e-3, at.previews).tau
    )


@pytest.mark.parametrize("name", MODEL_BASED)
def test_a_nominal_model_of_another_robot_is_refused(name: str) -> None:
    controller = make_controller(name, robot(), settings())
    with pytest.raises(InputError, match="armature has 3"):
        controller.configure(settings(nominal=NominalSettings(armature=(0.1, 0.1, 0.1))))
    with pytest.raises(InputError, match="armature has 3"):
        make_controller(name, robot(), settings(nominal=NominalSettings(armature=(0.1, 0.1, 0.1))))


def change(which: str) -> Settings:
    if which == "stiffer":
        first = Level((FramePosition(name="position", K_p=900.0, K_v=60.0),))
        return settings(stack=(first, *stack()[1:]))
    if which == "one level off":
        return settings(stack=(stack()[0], replace(stack()[1], enabled=False), stack()[2]))
    return settings(nominal=HEAVY)


def next_torques(controller: Controller, at: Moment, ticks: int) -> Array:
    """Returns the torques of a controller whose measured state is constant."""
    return np.array([controller.step(at.q, at.v, at.previews).tau for _ in range(ticks)])


@pytest.mark.parametrize("which", ["stiffer", "one level off", "nominal"])
@pytest.mark.parametrize("name", ["osf", "hqp"])
def test_a_change_of_settings_does_not_jump(name: str, which: str) -> None:
    """The torque is continuous and reaches that of the new settings after half a second."""
    at = moment(8)
    controller = make_controller(name, robot(), settings())
    start = controller.step(at.q, at.v, at.previews).tau
    pure = make_controller(name, robot(), change(which)).step(at.q, at.v, at.previews).tau
    assert np.abs(pure - start).max() > 1.0
    controller.configure(change(which))
    found = next_torques(controller, at, 520)
    steps = np.abs(np.diff(np.vstack([start, found]), axis=0)).max()
    assert steps < 0.01 * np.abs(pure - start).max()
    np.testing.assert_allclose(found[-1], pure, atol=1e-9)


def test_a_change_of_settings_does_not_jump_under_time_delay_estimation() -> None:
    """The acceleration that TDEOSF demands is continuous, and so is its torque."""
    at = moment(8)
    controller = make_controller("tdeosf", robot(), settings())
    tau_0 = np.zeros(7)
    asked = controller.step(at.q, at.v, at.previews, tau_0).tau
    pure = make_controller("tdeosf", robot(), change("stiffer")).step(at.q, at.v, at.previews, tau_0).tau
    assert np.abs(pure - asked).max() > 0.1
    controller.configure(change("stiffer"))
    np.testing.assert_allclose(controller.step(at.q, at.v, at.previews, tau_0).tau, asked, atol=1e-9)
    found = [controller.step(at.q, at.v, at.previews, tau_0).tau for _ in range(520)]
    np.testing.assert_allclose(found[-1], pure, atol=1e-9)


@pytest.mark.parametrize("name", RIVALS)
def test_levels_that_are_off_are_still_measured(name: str) -> None:
    """With all levels off, only damping runs; the errors of the tasks are still measured, and the levels can
    be enabled again."""
    at = moment(9)
    off = tuple(replace(level, enabled=False) for level in stack())
    controller = make_controller(name, robot(), settings(stack=off))
    plan = controller.step(at.q, at.v, at.previews)
    assert [level.name for level in plan.levels] == ["damping"]
    assert set(plan.errors) > {"position", "orientation", "q1"}
    controller.configure(settings(stack=off, damping=False))
    assert controller.step(at.q, at.v, at.previews).levels == ()
    controller.configure(settings())
    assert len(controller.step(at.q, at.v, at.previews).levels) == 3
