"""The controller in its loop: calm under every live change, inside its bounds whatever happens."""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc import HIMPC, FrameOrientation, FramePosition, Joints, Level, Limits, Settings
from himpc.configuration import Configuration
from himpc.references import Hold, Preview
from himpc.telemetry import AT_TORQUE
from lessons.events import Event, MoveLevel, MoveTarget, Push, Set
from lessons.scene import Scene
from lessons.scenes import load_scene
from lessons.session import Session
from robots import InputError, Robot, load_robot

Array = NDArray[np.float64]


def rows_of(session: Session, ticks: int) -> Array:
    return np.array([session.tick().copy() for _ in range(ticks)])


def field(session: Session, rows: Array, name: str) -> Array:
    return rows[:, session.layout.fields[name]]


def iiwa_settings(robot: Robot, **changes: Any) -> Settings:
    stack = (
        Level((FramePosition(name="position"),)),
        Level((FrameOrientation(name="orientation"),)),
        Level((Joints(name="q1", joints=robot.joint_names[:1]),)),
    )
    return Settings(**({"stack": stack, "M_bar": tuple(robot.M_bar)} | changes))


def holds(robot: Robot, N: int, T_s: float = 1e-3) -> dict[str, Preview]:
    """Previews that ask to stay at home."""
    configuration = Configuration(robot, robot.model.createData(), robot.home, np.zeros(robot.n))
    tip = configuration.placement()
    values = {"position": tip.translation, "orientation": tip.rotation, "q1": robot.home[:1]}
    return {name: Hold(value.copy()).preview(0.0, T_s, N) for name, value in values.items()}


@pytest.fixture(scope="module")
def iiwa() -> Robot:
    return load_robot("iiwa14")


@pytest.fixture(scope="module")
def iiwa_scene() -> Scene:
    return load_scene("iiwa14-hold")


# ------------------------------------------------------------------ what it works with


@pytest.mark.parametrize("name", ["iiwa14-hold", "planar3-hold"])
@pytest.mark.parametrize("horizon", [1, 2, 20])
def test_any_horizon_holds_and_follows(name: str, horizon: int) -> None:
    """N = 1 (HIQP) and long horizons keep the arm on its targets and bring it to a moved one."""
    scene = load_scene(name)
    session = Session(replace(scene, settings=replace(scene.settings, horizon=horizon)))
    target = session.target("position")
    assert target is not None
    goal = target.value.copy()
    goal[0] -= 0.05
    session.tick()
    session.post(MoveTarget("position", tuple(goal)))
    rows = rows_of(session, 1500)
    assert np.abs(field(session, rows, "error/position")[-1]).max() < 2e-3
    assert np.linalg.norm(field(session, rows, "x/position")[-1] - goal) < 4e-3
    assert np.nansum(field(session, rows, "unsolved")) == 0


def test_six_joints_under_a_full_stack(example_urdf: Callable[[str], str]) -> None:
    """A 6-DoF arm under 3+3+1 rows: level 3 has no freedom, changes nothing and breaks nothing."""
    robot = load_robot(example_urdf("ur_description/urdf/ur10_robot.urdf"))
    assert robot.n == 6
    scene = load_scene("hold", example_urdf("ur_description/urdf/ur10_robot.urdf"))
    third = Level((Joints(name="q1", joints=robot.joint_names[:1]),))
    settings = replace(scene.settings, levels=(*scene.settings.levels[:2], third))
    for route in ("structured", "explicit"):
        session = Session(replace(scene, settings=replace(settings, route=route)))
        start = session.robot.home
        session.post(Set("levels.q1.K_p", 400))
        rows = rows_of(session, 300)
        assert session.plan is not None
        assert [level.name for level in session.plan.levels] == ["position", "orientation", "q1"]
        last = session.plan.levels[-1]
        assert (last.rung, last.status) == ("solve", "empty")
        np.testing.assert_array_equal(last.U, session.plan.levels[1].U)
        assert np.nanmax(field(session, rows, "priority_leak")) <= 1e-6
        assert np.nansum(field(session, rows, "unsolved")) == 0
        assert np.abs(session.plant.q - start).max() < 0.02


def test_the_damping_level_fills_what_is_left(iiwa: Robot) -> None:
    """It comes last when the enabled levels leave freedom, stays away when they do not, and can be off."""
    previews = holds(iiwa, 5)

    def names(**changes: Any) -> list[str]:
        controller = HIMPC(iiwa, iiwa_settings(iiwa, **changes))
        return [level.name for level in controller.step(iiwa.home, np.zeros(7), previews).levels]

    stack = iiwa_settings(iiwa).stack
    # 3 + 3 + 1 rows of full rank leave a 7-joint arm nothing.
    assert names() == ["position", "orientation", "q1"]
    assert names(stack=stack[:2]) == ["position", "orientation", "damping"]
    off = tuple(replace(level, enabled=False) for level in stack)
    assert names(stack=off) == ["damping"]
    assert names(stack=(off[0], stack[1], off[2])) == ["orientation", "damping"]
    assert names(stack=stack[:2], damping=False) == ["position", "orientation"]
    assert names(stack=off, damping=False) == []


# ------------------------------------------------------------------ whatever comes in


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
    route=st.sampled_from(["structured", "explicit"]),
    solver=st.sampled_from(["daqp", "daqp", "daqp", "proxqp"]),
    position=st.sampled_from(["viability", "paper", "off"]),
)
@settings(max_examples=40)
def test_whatever_comes_in_the_torque_is_finite_and_in_bounds(
    iiwa: Robot, seed: int, states: list[tuple[str, ...]], N: int, route: Any, solver: Any, position: Any
) -> None:
    """Random, huge or not finite states, references and torques: never an exception."""
    rng = np.random.default_rng(seed)
    torque_scale, velocity_scale = 10 ** rng.uniform([-2, -3], [1, 2])
    limits = Limits(position=position, velocity_scale=velocity_scale, torque_scale=torque_scale)
    T_s = 10 ** rng.uniform(-4, -1.7)
    controller = HIMPC(
        iiwa,
        iiwa_settings(
            iiwa,
            horizon=N,
            T_s=T_s,
            route=route,
            solver=solver,
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
        previews["position"] = replace(preview, value=odd, velocity=preview.velocity + odd)
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
    """The plan says so: rung "hold", one unsolved; the next good state goes on as if fresh."""
    controller = HIMPC(iiwa, iiwa_settings(iiwa))
    tau = np.linspace(-5, 5, 7)
    controller.reset(tau)
    plan = controller.step(np.full(7, np.nan), np.zeros(7), holds(iiwa, 5))
    np.testing.assert_array_equal(plan.tau, tau)
    assert plan.levels[0].rung == "hold"
    assert plan.unsolved == 1
    plan = controller.step(iiwa.home, np.zeros(7), holds(iiwa, 5))
    assert [level.rung for level in plan.levels] == ["solve"] * 3


# ------------------------------------------------------------------ live changes


def change_events(scene: Scene) -> dict[str, list[Event]]:
    """Every setting a learner can change, as single changes from the scene's start."""
    names = [level.name for level in scene.settings.levels]
    M_bar = [1.5 * m for m in scene.settings.M_bar]
    singles = {
        "horizon=1": Set("horizon", 1),
        "horizon=12": Set("horizon", 12),
        "M_bar_scale=0.5": Set("M_bar_scale", 0.5),
        "M_bar_scale=2": Set("M_bar_scale", 2),
        "M_bar": Set("M_bar", M_bar),
        "Q": Set("Q", 2000),
        "R": Set("R", 0.5),
        "R of level 2": Set("levels.2.R", 300),
        "T_s=0.002": Set("T_s", 0.002),
        "T_s=0.0005": Set("T_s", 0.0005),
        "K_p": Set("levels.1.K_p", 300),
        "K_v": Set("levels.2.K_v", 25),
        "torque_scale": Set("limits.torque_scale", 0.8),
        "velocity_scale": Set("limits.velocity_scale", 0.1),
        "position=paper": Set("limits.position", "paper"),
        "position=off": Set("limits.position", "off"),
        "no velocity limits": Set("limits.velocity", False),
        "no torque limits": Set("limits.torque", False),
        "explicit": Set("route", "explicit"),
        "proxqp": Set("solver", "proxqp"),
        "R_on": Set("R_on", "acceleration"),
        "no damping": Set("damping", False),
        "level horizon": Set("levels.2.horizon", 1),
    }
    changes: dict[str, list[Event]] = {name: [event] for name, event in singles.items()}
    for name in names:
        changes[f"{name} off and on"] = [Set(f"levels.{name}.enabled", on) for on in (False, True)]
    changes["last level first"] = [MoveLevel(names[-1], 0)]
    changes["first level last"] = [MoveLevel(names[0], len(names) - 1)]
    return changes


CASES = [
    (name, change) for name in ("iiwa14-hold", "planar3-hold") for change in change_events(load_scene(name))
]


@pytest.mark.parametrize(("name", "change"), CASES)
def test_changes_at_rest_are_bumpless(name: str, change: str) -> None:
    """On satisfied targets a change moves no torque by 5 % of its limit and the tip by less than 1 mm."""
    scene = load_scene(name)
    session = Session(scene)
    rows_of(session, 20)
    tau, start = session.plant.tau.copy(), session.plant.frame_pose(session.robot.tip)[1].copy()
    events = change_events(scene)[change]
    torque, moved = 0.0, 0.0
    for event in events:
        session.post(event)
        for _ in range(500 // len(events)):
            row = session.tick()
            step = np.abs(row[session.layout.fields["tau_demand"]] - tau) / session.robot.tau_limit
            torque = max(torque, float(step.max()))
            tip = session.plant.frame_pose(session.robot.tip)[1]
            moved = max(moved, float(np.linalg.norm(tip - start)))
    assert not session.notices
    assert len(session.log) == len(events)
    assert torque < 0.05
    assert moved < 1e-3


def test_a_level_enabled_with_a_large_error_fades_in(iiwa_scene: Scene) -> None:
    """Its Q ramps over half a second: the first torques after the switch are calm, and it gets there."""
    session = Session(iiwa_scene)
    session.post(Set("levels.orientation.enabled", False))
    session.post(Set("levels.posture.enabled", False))
    session.tick()
    session.post(MoveTarget("orientation", (0.3, 0.8, 0.0, 0.4)))
    rows_of(session, 1500)
    before = session.plant.tau.copy()
    session.post(Set("levels.orientation.enabled", True))
    rows = rows_of(session, 20)
    assert (np.abs(field(session, rows, "tau_demand") - before) / session.robot.tau_limit).max() < 0.05
    rows = rows_of(session, 3000)
    assert np.abs(field(session, rows, "error/orientation")[-1]).max() < 0.05
    assert np.abs(field(session, rows, "error/position")).max() < 1e-2


def test_a_torque_limit_tightened_below_the_present_torque_closes_in(iiwa_scene: Scene) -> None:
    """The bound starts at the torque of now and falls without a step; the demand stays inside it."""
    session = Session(iiwa_scene)
    rows_of(session, 20)
    present = np.abs(session.plant.tau / session.robot.tau_limit).max()
    assert present > 0.05
    session.post(Set("limits.torque_scale", float(0.8 * present)))
    rows = rows_of(session, 1500)
    lower, upper = field(session, rows, "tau_lower"), field(session, rows, "tau_upper")
    demand = field(session, rows, "tau_demand")
    limit = session.robot.tau_limit
    assert ((demand <= upper) & (demand >= lower)).all()
    for bound in (lower, upper):
        assert (np.abs(np.diff(bound, axis=0)) / limit).max() < 0.01
    assert (np.maximum(upper, -lower)[0] / limit).max() > 0.97 * present
    np.testing.assert_allclose(upper[-1], 0.8 * present * limit)
    assert (field(session, rows, "at_bound").astype(int)[-1] & AT_TORQUE).any()
    assert np.isfinite(rows[:, session.layout.fields["q"]]).all()


def test_wrong_settings_change_nothing(iiwa: Robot) -> None:
    """A refused configure leaves the controller as it was, to the bit."""
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


# ------------------------------------------------------------------ rough treatment

JUMPS = {
    "iiwa forward": ("iiwa14-hold", (1.0, 0.0, 0.0)),
    "iiwa up": ("iiwa14-hold", (0.0, 0.0, 1.0)),
    "iiwa down": ("iiwa14-hold", (0.0, 0.0, -1.0)),
    "planar back": ("planar3-hold", (-1.0, 0.0)),
    "planar side": ("planar3-hold", (0.0, 1.0)),
}


@lru_cache(maxsize=len(JUMPS))
def after_jump(case: str) -> tuple[Session, Array]:
    """Two and a half seconds after the target was put 1 m away at once, reachable or not."""
    name, jump = JUMPS[case]
    session = Session(load_scene(name))
    session.tick()
    target = session.target("position")
    assert target is not None
    session.post(MoveTarget("position", tuple(target.value + np.array(jump))))
    return session, rows_of(session, 2500)


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_the_torque_in_its_bounds(case: str) -> None:
    """A gizmo jump of 1 m: everything stays finite, and no torque is asked for beyond its bound."""
    session, rows = after_jump(case)
    assert np.isfinite(field(session, rows, "q")).all()
    assert np.isfinite(field(session, rows, "tau")).all()
    assert (np.abs(field(session, rows, "tau_demand")) <= field(session, rows, "tau_upper")).all()
    assert np.nanmax(field(session, rows, "priority_leak")) <= 1e-6


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_velocities_in_their_bounds(case: str) -> None:
    """No joint is faster than 1.10 of its limit."""
    session, rows = after_jump(case)
    assert (np.abs(field(session, rows, "v")) / field(session, rows, "v_limit")).max() <= 1.10


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_positions_in_their_bounds(case: str) -> None:
    """No joint passes its limit."""
    session, rows = after_jump(case)
    q, lower, upper = (field(session, rows, name) for name in ("q", "q_lower", "q_upper"))
    bounded = np.isfinite(upper - lower)
    share = np.abs(q - (lower + upper) / 2)[bounded] / ((upper - lower) / 2)[bounded]
    assert share.max(initial=0.0) <= 1.0


SUBSETS = [names for size in range(4) for names in combinations(("position", "orientation", "posture"), size)]


@pytest.mark.parametrize("enabled", SUBSETS, ids=lambda names: "+".join(names) or "none")
def test_a_push_dies_out_under_every_subset_of_levels(enabled: tuple[str, ...], iiwa_scene: Scene) -> None:
    """5 N·m for 0.1 s on a middle link: whatever is switched on, all joints are slow 3 s later."""
    session = Session(iiwa_scene)
    for name in ("position", "orientation", "posture"):
        session.post(Set(f"levels.{name}.enabled", name in enabled))
    rows_of(session, 20)
    body = session.robot.joint_names[3]
    session.post(Push(body, torque=(2.0, 3.0, 3.4641), seconds=0.1))
    rows = rows_of(session, 3100)
    assert np.abs(field(session, rows, "v")[:120]).max() > 0.02
    assert np.abs(field(session, rows, "v")[-1]).max() < 0.05
    assert session.diverged_at is None


def test_same_events_same_numbers_to_the_bit(iiwa_scene: Scene) -> None:
    """Two sessions that are told the same give the same rows, timing aside."""
    script: dict[int, Event] = {
        3: MoveTarget("position", (0.5, 0.2, 0.6)),
        40: Set("levels.orientation.enabled", False),
        60: Set("horizon", 9),
        90: Push(iiwa_scene.robot.joint_names[2], force=(0.0, 20.0, 0.0)),
        120: MoveLevel("posture", 0),
        150: Set("limits.velocity_scale", 0.2),
    }
    results = []
    for _ in range(2):
        session = Session(iiwa_scene, seed=4)
        rows = []
        for k in range(250):
            if k in script:
                session.post(script[k])
            rows.append(session.tick().copy())
        timing = [f for f in session.layout.fields if f.split("/")[0] in ("step_us", "time_us", "qp_us")]
        assert len(timing) >= 4
        array = np.array(rows)
        for name in timing:
            array[:, session.layout.fields[name]] = 0.0
        assert len(session.log) == len(script)
        results.append(array.tobytes())
    assert results[0] == results[1]


def test_the_controller_sees_no_mass(iiwa: Robot) -> None:
    """On a robot with the same geometry and other masses it answers with the same torques to the bit."""
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


# ------------------------------------------------------------------ evidence


def test_binding_constraints_are_named(iiwa_scene: Scene) -> None:
    """While a fast move presses on a velocity bound the plan names level, joint, kind, side and pressure."""
    session = Session(iiwa_scene)
    session.post(Set("limits.velocity_scale", 0.05))
    session.tick()
    session.post(MoveTarget("position", (0.4, 0.4, 0.5)))
    rows_of(session, 900)
    bindings = session.binding()
    assert bindings
    first = bindings[0]
    assert first.level in ("position", "orientation", "posture")
    assert first.joint in session.robot.joint_names
    assert {binding.kind for binding in bindings} == {"velocity"}
    assert first.side in ("upper", "lower")
    assert first.multiplier > 0
    assert abs(first.slack) < 1e-6
    assert 1 <= first.knot <= session.settings.horizon


def test_a_plan_carries_its_evidence(iiwa: Robot) -> None:
    """Per level: increments, cost, residual, time, leak; the torque is τ₀ plus the first input."""
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
