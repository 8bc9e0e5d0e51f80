"""Every explanation that names a cause is tested by runs with and without this cause: without it, the effect
disappears.

`interventions` describes the rows, and `interventions_all` contains them.
"""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from course_runs import CourseRuns
from interventions import Intervention
from interventions_all import ROWS
from quoted import step_of
from test_lessons_quoted import texts

from docs.further import further
from docs.further.deliveries import HAND, RADIUS, TURN
from himpc.controllers import null_space_control
from lessons.course import COURSE, load_lesson
from lessons.events import MoveTarget, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.session.torque import TorqueSession
from robots import Plant

ROOT = Path(__file__).parents[2]
DOCUMENTS = {
    "disagreements": "docs/disagreements.md",
    "results": "docs/results.md",
    "house": "docs/house.md",
    "glossary": "app/html/glossary.toml",
    "README": "README.md",
}
"""The documents that `Intervention.at` can name, as paths."""
COMPARED = ("himpc", "tdeosf", "hiqp")


@cache
def told(at: str) -> str:
    """Returns the complete text of a step, a derivation or a document, in one line."""
    kind, _, name = at.partition("/")
    if kind in COURSE:
        found = [texts(step_of(at))]
    elif kind == "further":
        more = further(name)
        found = [line.words for line in more.derivation]
        found += [text for each in more.questions for text in (each.asked, each.answered)]
    else:
        found = [(ROOT / DOCUMENTS[kind]).read_text(encoding="utf-8")]
    return " ".join(" ".join(found).split())


def named(each: Intervention) -> str:
    return f"{each.at} {each.says}"[:70]


@pytest.mark.parametrize("row", ROWS, ids=named)
def test_an_explanation_stands_there(row: Intervention) -> None:
    assert row.says in told(row.at)


@pytest.mark.parametrize("row", ROWS, ids=named)
def test_a_row_can_fail(row: Intervention) -> None:
    """The two ranges of a row overlap only if the row says that the quantity is not the cause. The two runs
    of a row differ."""
    (low, high), (low_gone, high_gone) = row.there, row.gone
    assert low < high and low_gone < high_gone
    apart = high < low_gone or high_gone < low
    assert apart != row.stays
    assert row.runs[0] != row.runs[1]


@pytest.mark.parametrize("row", ROWS, ids=named)
def test_without_its_cause_an_effect_goes(row: Intervention, course_runs: CourseRuns) -> None:
    there, gone = (course_runs.values[spec][row.measure] for spec in row.runs)
    assert row.there[0] <= there <= row.there[1], there
    assert row.gone[0] <= gone <= row.gone[1], gone


def test_a_multiplier_is_half_of_what_a_bound_costs_a_level() -> None:
    """The statement of the glossary is correct: for the costs (31), which have no factor one half, the price
    is twice the multiplier."""
    scene = load_lesson("inside-the-qp").run_of(step_of("inside-the-qp/2")).prepared()

    def after(ticks: int, change: float) -> TorqueSession:
        session = begin(scene)
        assert isinstance(session, TorqueSession)
        for _ in range(ticks):
            session.tick()
        session.post(Set("limits.torque_scale", 0.25 + change))
        return session

    def cost(ticks: int, change: float) -> float:
        return float(after(ticks, change).tick()[layout.fields["cost/pose"]][0])

    session = after(231, 0.0)
    session.tick()
    layout, (bound,) = session.layout, session.binding()
    assert (bound.level, bound.kind) == ("pose", "torque")
    room = 1e-5 * 4.0  # N·m: the limit of the motors is 4
    price = (cost(231, -1e-5) - cost(231, 1e-5)) / (2.0 * room)
    assert price == pytest.approx(2.0 * bound.multiplier, rel=1e-4)
    assert "by twice the bound's multiplier, per N·m" in told("inside-the-qp/2")


def test_clipped_torques_do_not_lie_on_the_line() -> None:
    """*Inside the QP*: if the torque of OSF is clipped joint by joint, the acceleration of level 1
    changes."""
    assert "The clipped torques would no longer lie on the orange line" in told("inside-the-qp/2")
    scene = load_lesson("inside-the-qp").run_of(step_of("inside-the-qp/2")).but("controller=osf").prepared()
    found = run(scene)
    tau, limit = found["tau_demand"], 0.25 * np.array(scene.robot.tau_limit)
    worst = int(np.argmax(np.abs(tau / limit).max(axis=1)))
    plant = Plant(scene.robot, scene.settings.plant)
    plant.reset(found["q"][worst])

    def leak(room: float) -> float:
        """Returns by how much clipping changes the acceleration of level 1 along x, m/s²."""
        lost = np.clip(tau[worst], -room * limit, room * limit) - tau[worst]
        return abs(float((plant.jacobian(scene.robot.tip) @ np.linalg.solve(plant.mass_matrix(), lost))[0]))

    assert leak(1.0) > 0.1
    assert leak(1.4) < 1e-12  # nothing is clipped


def test_weak_motors_hold_a_pressing_arm_at_rest() -> None:
    """*A blind arm*: if motors with a quarter of the torque clip it, the arm presses as hard as with the
    bound of a quarter inside the QPs, and stays at rest. With that bound the elbow swings four times a
    second."""
    told_here = told("a-blind-arm/2")
    assert "Motors a quarter as strong would leave 220 N, at rest, too" in told_here
    assert "the elbow swings four times a second" in told_here
    scene = load_lesson("a-blind-arm").run_of(step_of("a-blind-arm/2")).but("limits.torque=false").prepared()
    weak = replace(scene.robot, tau_limit=0.25 * scene.robot.tau_limit)
    found = run(replace(scene, robot=weak), 5.0)
    late = found["t"][:, 0] > 2.0
    assert np.abs(found["tau"][late]).max(axis=0)[[1, 3]] == pytest.approx(weak.tau_limit[[1, 3]])
    assert found["contact_force"][late].mean() == pytest.approx(218.5, abs=3.0)
    assert np.abs(found["v"][late] / scene.robot.v_limit).max() < 0.05
    bounded = run(load_lesson("a-blind-arm").run_of(step_of("a-blind-arm/2")).prepared(), 5.0)
    elbow = bounded["v"][bounded["t"][:, 0] > 2.0, 4]
    upwards = np.flatnonzero((elbow[:-1] < 0.0) & (elbow[1:] >= 0.0))
    assert 1e3 / np.diff(upwards).mean() == pytest.approx(4.0, abs=0.4)


def test_a_distance_that_is_not_at_its_bound_changes_no_error() -> None:
    """*Keeping clear*: on a way that leads past no object, no row of a distance is active, and all errors are
    those of the arm that keeps no distances. The posture has an error in both cases."""
    assert "Where the bound is not active, it causes no error" in told("keeping-clear/2")
    free = ((0.1, MoveTarget("position", (0.5, 0.1, 0.6))),)
    kept, bare = (
        run(RunSpec("iiwa14-table", set=(f"avoidance.on={on}",), events=free, duration=2.4).prepared())
        for on in ("true", "false")
    )
    levels = ("position", "orientation", "posture")
    assert not any(kept[f"active/{name}"].max() > 0.0 for name in levels)
    for name in levels:
        np.testing.assert_allclose(kept[f"error/{name}"], bare[f"error/{name}"], atol=1e-3)
    assert math.degrees(np.linalg.norm(kept["error/posture"][-1])) > 30.0


def test_a_filter_behind_the_levels_bounds_no_speed() -> None:
    """*Keeping clear*: in a run of three drags a joint exceeds its limit with the filter, and not with the
    rows; without the rows of speed it exceeds its limit there, too. Nothing is touched in these runs."""
    assert "with other drags a joint exceeds its limit, which the rows" in told("keeping-clear/3")
    places = ((0.42, -0.02, 0.6), (0.26, 0.0, 0.31), (0.2, 0.06, 0.45))
    drags = tuple((0.1 + 0.8 * k, MoveTarget("position", place)) for k, place in enumerate(places))

    def fastest(*more: str) -> float:
        spec = RunSpec("iiwa14-table", set=("avoidance.on=true", *more), events=drags, duration=2.5)
        found = run(spec.prepared())
        assert found["contact_force"].max() == 0.0
        return float(np.abs(found["v"] / found.session.robot.v_limit).max())

    assert fastest("controller=himpc_filtered") > 1.01
    assert fastest("controller=himpc") < 0.95
    assert fastest("controller=himpc", "limits.velocity=false") > 1.01


def test_the_base_still_drives_when_people_move() -> None:
    """*Deliveries*: at 8 s the base is at the limit of the arm's reach, 5 cm before the point where it rests
    if nobody moves; then it drives back along this limit. The page of the lesson names the same numbers."""
    assert "5 cm before the point nearest to the old place" in told("deliveries/3")
    assert "at 8 s it has 5 cm to go" in told("further/deliveries")
    lesson = load_lesson("deliveries")
    stays, moves = (run(lesson.run_of(lesson.steps[k]).prepared(), 13.95) for k in (2, 3))
    rest = stays["x/base"][-1]
    now = int(np.searchsorted(moves["t"][:, 0], 8.0 - 1e-9))
    assert 1e3 * np.linalg.norm(moves["x/base"][now] - rest) == pytest.approx(50.0, abs=2.0)
    arm = moves["x/base"][now:] - moves["x/ee"][now:, :2]
    np.testing.assert_allclose(np.linalg.norm(arm, axis=1), RADIUS, atol=1e-3)
    np.testing.assert_allclose(moves["x/ee"][now, :2], HAND, atol=1e-3)
    angle = np.unwrap(np.arctan2(arm[:, 1], arm[:, 0]))
    assert angle[-1] - angle[0] == pytest.approx(math.radians(4.8), abs=math.radians(0.1))
    towards = stays["x/base"][-1] - stays["x/ee"][-1, :2]
    assert angle[-1] - math.atan2(towards[1], towards[0]) == pytest.approx(TURN, abs=math.radians(0.1))


@pytest.mark.parametrize(("K_p", "period"), [(100.0, 0.628), (400.0, 0.314)])
def test_a_hand_without_a_damper_swings_like_the_wish(K_p: float, period: float) -> None:
    """*One task*: the hand oscillates with ω = √K_P, also for another K_P."""
    assert "thus a period of 0.63 s" in told("one-task/1")
    spec = load_lesson("one-task").run_of(step_of("one-task/1")).but(f"tasks.position.K_p={K_p}")
    found = run(replace(spec, duration=3.0).prepared())
    x, t = found["error/position"][:, 0], found["t"].ravel()
    crossed = ((x[1:] > 0) != (x[:-1] > 0)) & (t[1:] > 0.5)
    half = np.diff(t[1:][crossed])
    assert 2.0 * float(np.mean(half)) == pytest.approx(period, rel=0.02)


def test_the_average_cost_of_a_noisy_run_is_noise() -> None:
    """The statement of the page of disagreements is correct: the average cost (41) contains a measured
    acceleration, and its noise is nearly equal for the three controllers."""
    assert "whose noise is nearly the same for all three" in told("disagreements")

    def costs(*more: str) -> list[float]:
        specs = [RunSpec("planar3-circle", duration=1.0).but(f"controller={c}", *more) for c in COMPARED]
        return [summary(run(spec.prepared()))["average_cost"][0] for spec in specs]

    noisy, ideal = costs("plant.encoder_resolution_deg=0.00125"), costs()
    assert max(noisy) < 1.15 * min(noisy)
    assert min(noisy) > 1e4 * max(ideal)


def test_TDEOSF_gets_through_without_leaving_out_singular_values(monkeypatch: pytest.MonkeyPatch) -> None:
    """The statement of the page of disagreements is correct: TDEOSF starts equally well if all singular
    values are kept."""
    assert "TDEOSF starts equally well if all of them are kept" in told("disagreements")

    def largest() -> float:
        spec = RunSpec("iiwa14-circle-paper", controller="tdeosf", duration=0.3)
        return float(np.abs(run(spec.prepared())["tau_demand"]).max())

    usual = largest()
    monkeypatch.setattr(null_space_control, "ROUNDING", 0.0)
    assert largest() == pytest.approx(usual, rel=0.05)
