"""References have consistent derivatives, their previews agree with the later motion, and a dragged target
keeps its caps."""

from __future__ import annotations

from collections.abc import Callable
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.controllers import dragged_target
from himpc.references import (
    JOINT_CAPS,
    POSITION_CAPS,
    ROTATION_CAPS,
    Caps,
    Circle,
    FigureEight,
    Hold,
    Phase,
    Preview,
    Reference,
    Sinusoid,
    Target,
    Waypoints,
)
from himpc.rotation import exp3, from_quaternion, log3, quaternion

Array = NDArray[np.float64]
T_S = 1e-3
seeds = st.integers(0, 2**32 - 1)


def curves(rng: np.random.Generator) -> dict[str, Reference]:
    centre, u, w = rng.normal(0, 1, (3, 3))
    eased = Phase(rng.uniform(0.3, 4), "eased", rng.uniform(-3, 3))
    uniform = Phase(rng.uniform(0.3, 4), "uniform", rng.uniform(-3, 3))
    return {
        "circle": Circle(centre, u, w, uniform),
        "eased circle": Circle(centre, u, w, eased),
        "eight": FigureEight(centre, u, w, uniform),
        "eased eight": FigureEight(centre, u, w, eased),
        "sinusoid": Sinusoid(centre, u, uniform),
        "eased sinusoid": Sinusoid(centre, u, eased),
        "waypoints": Waypoints(rng.normal(0, 1, (4, 3)), np.array([0.5, 1.0, 2.5, 3.1])),
        "one waypoint": Waypoints(rng.normal(0, 1, (1, 3)), np.array([0.5])),
        "hold": Hold(centre),
    }


@pytest.mark.parametrize("name", curves(np.random.default_rng(0)))
@given(seed=seeds, t=st.floats(0, 4))
@settings(max_examples=25)
def test_derivatives_are_those_of_the_motion(name: str, seed: int, t: float) -> None:
    """ẋ_d and ẍ_d are finite differences of x_d, and the displacement is x_d(k+j) − x_d(k)."""
    reference = curves(np.random.default_rng(seed))[name]
    N = 4
    preview = reference.preview(t, T_S, N)
    h = 1e-4

    def at(time: float) -> Array:
        return reference.preview(time, T_S, 0).value

    for j in range(N + 1):
        now = t + j * T_S
        np.testing.assert_allclose(preview.value + preview.displacement[j], at(now), atol=1e-12)
        np.testing.assert_allclose(preview.velocity[j], (at(now + h) - at(now - h)) / (2 * h), atol=2e-4)
        second = (at(now + h) - 2 * at(now) + at(now - h)) / h**2
        # A quintic's jerk jumps at a waypoint, so the error of its ẍ_d is of the order jerk · h.
        np.testing.assert_allclose(preview.acceleration[j], second, atol=2e-1)
    assert not preview.displacement[0].any()


def test_waypoints_are_met_at_rest() -> None:
    """Every point is reached at its time with zero velocity and acceleration; after the last one the
    reference is constant."""
    points = np.random.default_rng(1).normal(0, 1, (3, 2))
    reference = Waypoints(points, np.array([1.0, 2.0, 4.0]))
    for time, point in ((0.0, 0), (1.0, 0), (2.0, 1), (4.0, 2), (9.0, 2)):
        preview = reference.preview(time, T_S, 0)
        np.testing.assert_allclose(preview.value, points[point], atol=1e-12)
        np.testing.assert_allclose(preview.velocity, 0.0, atol=1e-12)
        np.testing.assert_allclose(preview.acceleration, 0.0, atol=1e-9)
    with pytest.raises(ValueError, match="must increase strictly"):
        Waypoints(points, np.array([1.0, 1.0, 2.0]))


def test_an_eased_phase_rests_at_both_ends_of_a_turn() -> None:
    phase, rate, acceleration = Phase(2.0, "eased", 0.3).at(np.array([0.0, np.pi]))
    np.testing.assert_allclose(phase, [0.3, 0.3 + 2 * np.pi])
    np.testing.assert_allclose(np.array([rate, acceleration]), 0.0, atol=1e-12)


# ------------------------------------------------------------------ the dragged target


@given(seeds, st.booleans(), st.integers(1, 12))
@settings(max_examples=30)
def test_a_target_shows_the_kernel_what_it_previews(seed: int, turns: bool, N: int) -> None:
    """A target that is read by `show` moves bitwise like a target that is read by `preview`, also at rest and
    after a new target."""
    rng = np.random.default_rng(seed)
    start = np.eye(3) if turns else np.zeros(3)
    one, other = dragged_target(start), dragged_target(start)
    room = np.full((3, N + 1, 5), np.nan)
    motion, seen, value = room[:, :, 1:4], None, start.ravel()
    shown = 0
    moves = {int(k): rng.normal(0, 0.02, 3) for k in rng.integers(0, 300, 3)}
    for k in range(900):
        if k in moves:
            for target in (one, other):
                target.move(exp3(moves[k]) if turns else moves[k])
        t = k * T_S
        wanted = one.preview(t, T_S, N)
        if not other.stays(t, seen):
            x_d = other.show(t, T_S, motion)
            shown += x_d is not None
            if x_d is None:
                seen = other.preview(t, T_S, N)
                x_d, motion[0], motion[1], motion[2] = seen.value.ravel(), *seen[1:]
            else:
                seen = None
            value = x_d.copy()
        np.testing.assert_array_equal(value.reshape(start.shape), wanted.value)
        for found, expected in zip(motion, wanted[1:], strict=True):
            np.testing.assert_array_equal(found, expected)
    assert shown > 200


def drive(target: Target, ticks: int, hand: Callable[[int], Array | None], N: int = 5) -> list[Preview]:
    """Returns the previews of `ticks` control periods; `hand(k)` may move the raw target before tick k."""
    previews = []
    for k in range(ticks):
        moved = hand(k)
        if moved is not None:
            target.move(moved)
        previews.append(target.preview(k * T_S, T_S, N))
    return previews


def assert_consistent(previews: list[Preview], caps: Caps, hand_moved: set[int]) -> None:
    """Checks that caps hold, x_d moves by T_s(ẋ + ẋ')/2 and ẋ_d by T_s ẍ' per tick, and the preview agrees
    with the later motion."""
    for k, preview in enumerate(previews):
        v, a, d = preview.velocity, preview.acceleration, preview.displacement
        assert np.linalg.norm(v, axis=1).max() <= caps.speed * (1 + 1e-9)
        assert np.linalg.norm(a, axis=1).max() <= caps.acceleration * (1 + 1e-9)
        jerk = np.linalg.norm(np.diff(a, axis=0), axis=1).max() / T_S
        rest = ~v[1:].any(axis=1) & ~a[1:].any(axis=1)
        if not rest.any():
            assert jerk <= caps.jerk * (1 + 1e-6)
            np.testing.assert_allclose(v[1:], v[:-1] + T_S * a[1:], atol=1e-12)
            np.testing.assert_allclose(np.diff(d, axis=0), 0.5 * T_S * (v[1:] + v[:-1]), atol=1e-12)
        if k + 1 < len(previews) and k + 1 not in hand_moved:
            later = previews[k + 1]
            np.testing.assert_array_equal(later.velocity[:-1], v[1:])
            np.testing.assert_array_equal(later.acceleration[:-1], a[1:])
            np.testing.assert_allclose(later.displacement[:-1], d[1:] - d[1], atol=1e-12)


def step_between(one: Array, other: Array) -> Array:
    return log3(other @ one.T) if one.ndim == 2 else other - one


@given(seed=seeds, caps=st.sampled_from([POSITION_CAPS, ROTATION_CAPS, JOINT_CAPS]))
@example(seed=243, caps=JOINT_CAPS)  # the speed cap ends an acceleration across the motion
@settings(max_examples=12)
def test_a_dragged_position_keeps_its_caps_and_its_promises(seed: int, caps: Caps) -> None:
    """For all motions of the hand, speed, acceleration and jerk stay within their caps, and derivatives are
    consistent."""
    rng = np.random.default_rng(seed)
    target = dragged_target(rng.normal(0, 1, 3), caps)
    moves = {int(k): rng.normal(0, 10 ** rng.uniform(-3, 0.3), 3) for k in rng.integers(0, 400, 5)}
    previews = drive(target, 500, lambda k: moves.get(k))
    assert_consistent(previews, caps, set(moves))
    for before, after in pairwise(previews):
        step = 0.5 * T_S * (before.velocity[0] + after.velocity[0])
        np.testing.assert_allclose(after.value - before.value, step, atol=2e-9)


@given(seed=seeds, angle=st.floats(0.01, np.pi))
@settings(max_examples=8)
def test_a_dragged_rotation_keeps_its_caps_and_its_promises(seed: int, angle: float) -> None:
    """A dragged target on SO(3) keeps its caps and previews, for rotations of up to 180°, in world axes."""
    rng = np.random.default_rng(seed)
    axis = rng.normal(0, 1, 3)
    start = exp3(rng.normal(0, 1, 3))
    caps = Caps(1.2, 6.0, 120.0)
    target = dragged_target(start, caps)
    goal = exp3(angle * axis / np.linalg.norm(axis)) @ start
    previews = drive(target, 600, lambda k: goal if k == 0 else None)
    assert_consistent(previews, caps, {0})
    for before, after in pairwise(previews):
        step = log3(after.value @ before.value.T)
        np.testing.assert_allclose(step, before.displacement[1], atol=1e-9)
        np.testing.assert_allclose(after.value @ after.value.T, np.eye(3), atol=1e-10)


@pytest.mark.parametrize("distance", [1e-10, 1e-3, 0.1, 1.0])
def test_it_arrives_and_rests_exactly(distance: float) -> None:
    """The filtered target ends bitwise at the raw target, at rest, and does not drift afterwards."""
    target = dragged_target(np.zeros(3))
    goal = distance * np.array([0.6, 0.0, 0.8])
    last = drive(target, 8000, lambda k: goal if k == 3 else None)[-1]
    np.testing.assert_array_equal(last.value, goal)
    assert not last.velocity.any()
    assert not last.acceleration.any()
    assert not last.displacement.any()


@pytest.mark.parametrize("angle", [1e-3, 1.0, 3.0, np.pi])
def test_a_rotation_arrives_and_rests_exactly(angle: float) -> None:
    """For a rotation of 180° there are two shortest paths; the target follows one of them to the end."""
    goal = exp3(np.array([0.0, angle, 0.0]))
    target = dragged_target(np.eye(3))
    previews = drive(target, 9000, lambda k: goal if k == 0 else None)
    np.testing.assert_array_equal(previews[-1].value, goal)
    assert not previews[-1].velocity.any()
    turned = sum(np.linalg.norm(log3(b.value @ a.value.T)) for a, b in pairwise(previews))
    assert turned == pytest.approx(angle, rel=2e-2)


def test_a_hand_moved_in_mid_motion_leaves_no_jump() -> None:
    """A new raw target changes the acceleration; value and velocity are continuous."""
    target = dragged_target(np.zeros(3))
    hand = {0: np.array([0.4, 0, 0]), 350: np.array([-0.3, 0.5, 0.1]), 700: np.array([0.0, 0.0, 1.0])}
    previews = drive(target, 1000, lambda k: hand.get(k))
    velocity = np.array([p.velocity[0] for p in previews])
    value = np.array([p.value for p in previews])
    assert np.linalg.norm(velocity, axis=1).max() > 0.3
    assert np.linalg.norm(np.diff(velocity, axis=0), axis=1).max() <= 2.0 * T_S + 1e-12
    assert np.linalg.norm(np.diff(value, axis=0), axis=1).max() <= 0.5 * T_S + 1e-12
    acceleration = np.array([p.acceleration[0] for p in previews])
    assert np.linalg.norm(np.diff(acceleration, axis=0), axis=1).max() <= 40.0 * T_S * (1 + 1e-9)


def test_changed_horizon_and_period_go_on_smoothly() -> None:
    """N and T_s may change while the target moves."""
    target = dragged_target(np.zeros(2))
    target.move(np.array([0.5, 0.0]))
    t, values, velocities = 0.0, [], []
    for k in range(600):
        N, T_s = (3, 1e-3) if k < 300 else (12, 2e-3)
        preview = target.preview(t, T_s, N)
        assert preview.velocity.shape == (N + 1, 2)
        values.append(preview.value)
        velocities.append(preview.velocity[0])
        t += T_s
    assert np.abs(np.diff(values, axis=0)).max() <= 0.5 * 2e-3 + 1e-12
    assert np.abs(np.diff(velocities, axis=0)).max() <= 2.0 * 2e-3 + 1e-12


def test_asking_twice_at_one_time_changes_nothing() -> None:
    """A second call of `preview` at the same tick, for instance by the page, gives the same result."""
    target = dragged_target(np.zeros(2))
    target.move(np.array([0.5, 0.2]))
    for k in range(50):
        first = target.preview(k * T_S, T_S, 4)
        again = target.preview(k * T_S, T_S, 4)
        np.testing.assert_array_equal(first.velocity, again.velocity)
        np.testing.assert_array_equal(first.value, again.value)


def test_jump_rests_at_the_new_value() -> None:
    target = dragged_target(np.zeros(2))
    target.move(np.ones(2))
    drive(target, 100, lambda k: None)
    target.jump(np.array([2.0, 3.0]))
    preview = target.preview(0.0, T_S, 3)
    np.testing.assert_array_equal(preview.value, [2.0, 3.0])
    assert not preview.velocity.any()


def test_a_rotation_turns_about_all_axes() -> None:
    """The preview of a rotation has all components of ω_d, also for a task on fewer axes. The preview of a
    target at rest may have only the components of the task."""
    target = dragged_target(np.eye(3))
    target.move(exp3(np.array([0.0, 0.0, 0.5])))
    preview = drive(target, 50, lambda k: None)[-1]
    assert preview.velocity.shape == (6, 3)
    assert preview.velocity[0, 2] > 0.01
    assert Hold(np.eye(3), m=1).preview(0.0, T_S, 5).velocity.shape == (6, 1)


@given(seed=seeds)
@settings(max_examples=40)
def test_quaternions_and_matrices_go_back_and_forth(seed: int) -> None:
    """Quaternions of any length give the same matrix; the quaternion of a matrix has w ≥ 0."""
    rng = np.random.default_rng(seed)
    R = exp3(rng.normal(0, 2, 3))
    q = quaternion(R)
    assert q[3] >= 0
    assert np.linalg.norm(q) == pytest.approx(1)
    for length in (-7.5, 1e-200, 1e-310, 1e200, 1e308):
        np.testing.assert_allclose(from_quaternion(length * q), R, atol=1e-12)
    np.testing.assert_allclose(step_between(from_quaternion(q), R), 0.0, atol=1e-9)
