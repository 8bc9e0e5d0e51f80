"""Every explanation that names a cause is tested by runs with and without this cause: without it, the effect
disappears.

`interventions` describes the rows, and `interventions_all` contains them.
"""

from __future__ import annotations

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
from himpc.controllers import null_space_control
from lessons.course import COURSE, load_lesson
from lessons.events import Set
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
