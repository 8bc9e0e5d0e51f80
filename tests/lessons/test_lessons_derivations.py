"""Numbers and equations in the texts of the lessons that no run can check are computed again.

The predictions (14), (15), (18), (28) with c_l are compared with the printed matrices in
`test_himpc_prediction`, (31) to (35) in `test_himpc_cascade`, (8) to (13) of HTMPC in `test_htmpc_equations`.
"""

from __future__ import annotations

import json
import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from docs.further.how_far_ahead import effects, first_left
from himpc.limits import Limits, in_force
from himpc.limits.limits import POSITION_MARGIN
from himpc.limits.velocity import REACTION, viability_bounds
from himpc.prediction import residual_model
from lessons.course import load_lesson
from lessons.events import MoveTarget
from lessons.recording.run import run
from lessons.scenes.catalog import torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import TorqueScene
from robots import Plant, convergence_gauge, load_robot

Array = NDArray[np.float64]
OFF = ("limits.position=off", "limits.velocity=false", "limits.torque=false")


@pytest.fixture(scope="module")
def iiwa() -> tuple[Array, Array]:
    """Returns M at the start of `iiwa14-hold`, (7, 7), and the diagonal of its M̄."""
    scene = torque_scene("iiwa14-hold")
    plant = Plant(scene.robot, scene.settings.plant)
    plant.reset(scene.q_0)
    return plant.mass_matrix(), np.array(scene.settings.M_bar)


# -------------------------------------------------------------------------------- time-delay estimation


def test_an_error_of_acceleration_is_mapped_by_I_minus_M_inverse_M_bar(iiwa: tuple[Array, Array]) -> None:
    """By (8) and (12), with H_q from a millisecond ago and Δτ = M̄(wanted − q̈₀), the error is (I −
    M⁻¹M̄)(q̈₀ − wanted)."""
    rng = np.random.default_rng(0)
    M, M_bar = iiwa[0], np.diag(iiwa[1])
    forces, tau_0, wanted = rng.normal(size=(3, len(M)))
    before = np.linalg.solve(M, tau_0 - forces)
    after = np.linalg.solve(M, tau_0 + M_bar @ (wanted - before) - forces)
    expected = (np.eye(len(M)) - np.linalg.solve(M, M_bar)) @ (before - wanted)
    np.testing.assert_allclose(after - wanted, expected, rtol=1e-9, atol=1e-9)


@pytest.mark.parametrize(("scale", "radius"), [(1.0, 0.985), (6.0, 0.91), (7.0, 1.21)])
def test_the_gauge_of_no_model_needed(iiwa: tuple[Array, Array], scale: float, radius: float) -> None:
    """A radius near 1 can mean a slow mode (an eigenvalue near +1) or a nearly unstable one (near −1)."""
    assert convergence_gauge(iiwa[0], scale * iiwa[1])[1] == pytest.approx(radius, abs=0.01)


def test_at_six_times_M_bar_both_ends_of_the_spectrum_are_alike(iiwa: tuple[Array, Array]) -> None:
    left = 1.0 - np.linalg.eigvals(np.linalg.solve(iiwa[0], np.diag(6.0 * iiwa[1]))).real
    assert left.max() == pytest.approx(0.91, abs=0.01)
    assert left.min() == pytest.approx(-0.89, abs=0.02)


def test_a_norm_below_1_is_enough_and_not_necessary(iiwa: tuple[Array, Array]) -> None:
    """With 4 M̄ the norm of Remark 4 is 1.21: the error may grow in one step, but it vanishes after many
    steps."""
    norm, radius = convergence_gauge(iiwa[0], 4.0 * iiwa[1])
    assert norm == pytest.approx(1.21, abs=0.02) and radius < 0.95
    left = np.eye(7) - np.linalg.solve(iiwa[0], np.diag(4.0 * iiwa[1]))
    assert np.linalg.norm(np.linalg.matrix_power(left, 200)) < 1e-3


def test_remark_4_as_printed_is_for_a_diagonal_M(iiwa: tuple[Array, Array]) -> None:
    """1 − M̄ᵢ/λᵢ(M) are the eigenvalues of I − M⁻¹M̄ if M is diagonal, but not in general."""
    M, M_bar = iiwa

    def printed(M: Array) -> Array:
        return np.sort(np.asarray(1.0 - np.sort(M_bar) / np.sort(np.linalg.eigvalsh(M)), float))

    def true(M: Array) -> Array:
        return np.sort(np.asarray(1.0 - np.linalg.eigvals(np.linalg.solve(M, np.diag(M_bar))).real, float))

    diagonal = np.diag(np.sort(np.diag(M))[np.argsort(np.argsort(M_bar))])
    np.testing.assert_allclose(true(diagonal), printed(diagonal), atol=1e-9)
    assert np.abs(true(M) - printed(M)).max() > 0.05


# -------------------------------------------------------------------------------- stopping


def bound_at(degrees: float, reaction: float, margin: float) -> float:
    """Returns the permitted speed, deg/s, at this angle before the limit of joint 2 of the planar arm."""
    robot = load_robot("planar3")
    q = robot.q_upper - math.radians(degrees)
    force = in_force(robot, Limits(velocity=False))
    found = viability_bounds(
        q, robot.q_lower + margin, robot.q_upper - margin, force.v_limit, robot.a_max, reaction
    )
    return math.degrees(found[1, 1])


def test_the_speeds_of_stopping_takes_distance() -> None:
    """At 5° before the limit, the bound is 106°/s with an exact model and 13.5°/s with our margins; the text
    states the margins in use."""
    reaction = 1e-3 + REACTION / Limits().velocity_approach
    assert bound_at(5.0, 1e-3, 0.0) == pytest.approx(105.9, abs=0.1)
    assert bound_at(5.0, reaction, POSITION_MARGIN) == pytest.approx(13.5, abs=0.1)
    step = load_lesson("stopping-takes-distance").steps[2]
    assert reaction == pytest.approx(0.33, abs=0.005) and "0.33" in step.text
    assert math.degrees(POSITION_MARGIN) == pytest.approx(0.4, abs=0.005) and "0.4°" in step.text
    assert "106°/s" in step.why and "13.5°/s" in step.why


@pytest.mark.parametrize("reaction", [1e-3, 0.1, 0.334])
@pytest.mark.parametrize("room", [0.01, 0.1, 1.0])
def test_from_the_viable_speed_the_joint_stops_at_the_limit(reaction: float, room: float) -> None:
    """The printed root is a solution of v·t + v²/2a = q_s − q."""
    one, a = np.ones(1), 20.0
    v = viability_bounds(0.0 * one, -one, room * one, np.inf * one, a * one, reaction)[1, 0]
    assert v * reaction + v**2 / (2 * a) == pytest.approx(room, rel=1e-9)


# -------------------------------------------------------------------------------- tasks


def test_at_rest_the_residual_is_K_P_times_the_error() -> None:
    """By (28), the terms of a weighted sum are 200 m/s² per metre and 50 rad/s² per radian."""
    model = residual_model(np.array([200.0, 50.0]), np.array([10.0, 5.0]), 5, 1e-3)
    still = np.zeros((5, 2))
    e = model.free(np.ones(2), np.zeros(2), np.zeros(2), still, still, still)
    np.testing.assert_allclose(e, np.tile([200.0, 50.0], (5, 1)))


@pytest.mark.parametrize(("K_p", "Q", "share"), [(50.0, 200.0, 0.2), (50.0, 800.0, 0.5), (12.5, 200.0, 0.06)])
def test_two_wishes_about_one_coordinate_count_with_their_gains(K_p: float, Q: float, share: float) -> None:
    """*Two tasks, one arm*, derivation: joint 1 comes to rest between two targets, in proportion to Q K_P and
    not to Q K_P²."""
    wishes = [("a", 200.0, 28.0, 200.0), ("b", K_p, 2.0 * math.sqrt(K_p), Q)]
    stack = [
        {"task": "joints", "name": name, "joints": ["joint_1"], "K_p": p, "K_v": v, "Q": weight, "R": 10.0}
        for name, p, v, weight in wishes
    ]
    spec = RunSpec("planar3-hold", controller="weighted", duration=2.0).but(
        f"stack={json.dumps(stack)}", "horizon=1", "M_bar_scale=2", *OFF
    )
    start = float(spec.prepared().q_0[0])
    spec = replace(spec, events=((0.0, MoveTarget("b", (start + 0.5,))),))
    gone = (float(run(spec.prepared())["q"][-1, 0]) - start) / 0.5
    assert gone == pytest.approx(share, abs=0.01)
    assert share == pytest.approx(K_p * Q / (200.0 * 200.0 + K_p * Q), abs=0.002)


def test_with_links_2_and_3_in_line_any_motion_of_joint_1_moves_the_hand() -> None:
    """J_{2|1} = J₂P₁ of *When tasks fight* vanishes at q₃ = 0, but not near 90°."""
    robot = load_robot("planar3")
    plant = Plant(robot)

    def projected(q_3: float) -> float:
        plant.reset(np.radians([-40.0, 100.0, q_3]))
        J = plant.jacobian(robot.tip)[:2]
        return float(np.linalg.norm((np.eye(3) - np.linalg.pinv(J) @ J)[0]))

    assert projected(0.0) < 1e-9
    assert projected(-90.0) > 0.3
    assert projected(-10.0) < projected(-20.0) < projected(-45.0)


def test_R_weighs_as_much_as_the_error_around_1e5() -> None:
    """*One task under MPC*: for R of the order of 10⁵, Q‖J M̄⁻¹Δτ‖² and R‖Δτ‖² are of equal size."""
    scene = torque_scene("planar3-hold")
    robot = scene.robot
    plant = Plant(robot)
    plant.reset(scene.q_0)
    G = plant.jacobian(robot.tip)[:2] / np.array(scene.settings.M_bar)
    largest = 200.0 * np.linalg.norm(G, 2) ** 2
    assert 3e4 < largest < 3e5


@pytest.mark.parametrize(
    ("change", "kept"),
    [("limits.velocity=false", True), ("damping=true", False), ("limits.velocity=true", False)],
)
def test_a_direction_that_is_nobodys_keeps_its_torque(change: str, kept: bool) -> None:
    """Step *A motion without a task*: during a push, Δτ has no component in a direction that moves no task,
    unless a bound or another level requires one."""
    lesson = load_lesson("one-task")
    assert "in that direction the torque does not change, as long as no bound changes it" in " ".join(
        lesson.steps[3].text.split()
    )
    off = () if change == "limits.velocity=true" else ("limits.velocity=false",)
    scene = replace(lesson.run_of(lesson.steps[3]), duration=0.18).but(*off, change).prepared()
    assert isinstance(scene, TorqueScene)
    found, plant, M_bar = run(scene), Plant(scene.robot, scene.settings.plant), np.array(scene.settings.M_bar)

    def part(q: Array, delta: Array) -> float:
        plant.reset(q)
        return abs(float(np.linalg.svd(plant.jacobian(scene.robot.tip)[:2] / M_bar)[2][2] @ delta))

    pushed = slice(105, None)
    largest = max(map(part, found["q"][pushed], found["delta_tau"][pushed]))
    assert np.abs(found["delta_tau"][pushed]).max() > 0.05
    assert largest < 1e-9 if kept else largest > 0.01


def test_joint_2_turns_round_where_the_held_hand_lets_it_go_no_further() -> None:
    """*One task*, fourth step, without speed limits: when joint 2 reverses, the last link lies on the line
    from joint 1 to the hand. There the distance from joint 1 to joint 3, and therefore |q₂|, is extreme."""
    lesson = load_lesson("one-task")
    scene = lesson.run_of(lesson.steps[3]).but("limits.velocity=false").prepared()
    found = run(scene)
    t, v = found["t"][:, 0], found["v"]
    turned = int(np.argmax((t > 0.4) & (v[:, 1] > 0.0)))
    assert t[turned] == pytest.approx(0.3 + 0.75, abs=0.02)
    assert np.abs(v[turned, [0, 2]]).min() > 1.0  # rad/s: the elbow continues to move
    assert isinstance(scene, TorqueScene)
    plant = Plant(scene.robot, scene.settings.plant)
    plant.reset(found["q"][turned])
    J = plant.jacobian(scene.robot.tip)[:2]
    hand, last = (np.array([J[1, k], -J[0, k]]) for k in (0, 2))  # from joint 1 and from joint 3
    across = hand[0] * last[1] - hand[1] * last[0]
    assert abs(across) < 0.01 * np.linalg.norm(hand) * np.linalg.norm(last)


def test_the_first_of_twenty_changes_is_not_alone() -> None:
    """*How far ahead*, second step: in one coordinate, the first of twenty changes has about the effect of N
    = 1 with 0.17 R; if it were the only change, the effect would be that of R/20."""
    assert "It does not act like $10/20$" in " ".join(load_lesson("how-far-ahead").steps[1].why.split())
    c, g = 0.19 * effects(20)[:, 0], 0.19  # of R = Q = 1
    alone = 1.0 - c[0] * c.sum() / (c @ c + 1.0)
    share = [
        g**2 * effects(1)[0, 0] ** 2 * left / (1.0 - left) for left in (first_left(20, 1.0, 1.0, g), alone)
    ]
    assert share == pytest.approx([0.17, 1 / 20], rel=0.06)


def test_RT4_asks_joint_1_for_more_than_its_data_sheet_allows() -> None:
    """The page of disagreements says that the reference requires 141°/s and that the data sheet permits
    85."""
    scene = torque_scene("iiwa14-circle-paper")
    q1 = scene.references(scene.robot, scene.settings.levels)["q1"]
    asked = np.abs(q1.preview(0.0, 1e-3, 4000).velocity).max()
    assert math.degrees(asked) == pytest.approx(141.0, abs=0.5)
    assert math.degrees(scene.robot.v_limit[0]) == pytest.approx(85.0, abs=0.5)


def test_one_digit_of_a_coarse_encoder_is_almost_3_newton_metres() -> None:
    """*Sensors are coarse*: the size of one digit in the torque is M̄ δ/T_s²."""
    M_bar = float(torque_scene("planar3-circle").settings.M_bar[0])
    assert M_bar * math.radians(0.005) / 1e-6 == pytest.approx(2.9, abs=0.05)


def test_texts_that_name_a_step_time_name_the_readmes() -> None:
    """*How far ahead* and *Deadlines* quote the results of `benchmarks/` that are printed in the README."""
    text = load_lesson("how-far-ahead").steps[0].text
    readme = (Path(__file__).parents[2] / "README.md").read_text(encoding="utf-8")
    quoted = re.findall(r"0\.\d\d", text)
    assert quoted == ["0.04", "0.12", "0.21"]
    assert all(each in readme for each in quoted)
