"""In the reproduction, every item can be run, failed runs are data, and reports contain the measured
values."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lessons.experiments.jobs import Job, JobResult, Results, Work, perform_all
from lessons.papers import ITEMS
from lessons.papers.himpc_paper.ablations import EffortJob
from lessons.papers.himpc_paper.iiwa import smoothness
from lessons.papers.himpc_paper.planar import CRITERIA, rt1, rt2, rt3, verdicts
from lessons.papers.himpc_paper.theory import decrease, model_errors
from lessons.papers.item import Item, PaperCheck, Row, Section, Table, at_most
from lessons.papers.reproduce import Report, as_data, reproduce, write
from lessons.papers.words import printed
from lessons.plots.panels import Bars, Panel, Picture, PlotCurve
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import Scene
from robots import InputError

QUICK = (False, True)


def failed(jobs: Iterable[Work]) -> Results:
    """Returns a failed result for every job."""
    return {job: JobResult(job, {}, {}, "there was no time") for job in jobs}


@pytest.fixture(scope="module")
def short() -> dict[str, JobResult]:
    """Returns runs of 1.2 s of RT1 with two controllers."""
    jobs = {name: Job(RunSpec("planar3-circle", controller=name, duration=1.2)) for name in ("himpc", "osf")}
    found = perform_all(jobs.values())
    return {name: found[job] for name, job in jobs.items()}


# -------------------------------------------------------------------------------- items


def test_the_papers_tables_and_figures_are_there() -> None:
    """Every table and plot of the paper is an item, under the expected name."""
    tables = {f"himpc-table-{number}" for number in range(1, 9)}
    figures = {f"himpc-fig-{number}" for number in (*range(3, 16), *range(17, 22))}
    assert tables | figures | {"himpc-accuracy", "himpc-ablations", "himpc-value"} <= set(ITEMS)


@pytest.fixture(scope="module")
def prepared() -> dict[RunSpec, Scene]:
    """Every scene that an item runs is prepared once."""
    jobs = (job for item in ITEMS.values() for quick in QUICK for job in item.jobs(quick))
    return {spec: spec.prepared() for spec in dict.fromkeys(job.spec for job in jobs)}


@pytest.mark.parametrize("quick", QUICK)
def test_no_two_jobs_compute_the_same(quick: bool, prepared: dict[RunSpec, Scene]) -> None:
    """Two jobs with different keys never describe the same run, for example by a setting that equals that of
    the scene. Such a run would be computed twice."""
    seen: dict[str, Work] = {}
    for job in dict.fromkeys(job for item in ITEMS.values() for job in item.jobs(quick)):
        scene, spec = prepared[job.spec], job.spec
        events = scene.events if spec.events is None else spec.events
        duration = scene.duration if spec.duration is None else spec.duration
        parts = (
            type(job),
            replace(job, spec=RunSpec("")),
            scene.name,
            scene.settings,
            events,
            duration,
            spec.seed,
        )
        twin = seen.setdefault(repr(parts), job)
        assert twin is job, f"{twin.spec.command_line()} and {spec.command_line()}"


@pytest.mark.parametrize("quick", QUICK)
@pytest.mark.parametrize("name", ITEMS)
def test_every_job_can_be_set_up(name: str, quick: bool, prepared: dict[RunSpec, Scene]) -> None:
    """The scene, the controller and every assigned setting exist, so that no item fails because of a
    misspelled name."""
    for job in ITEMS[name].jobs(quick):
        scene = prepared[job.spec]
        assert scene.settings.controller == job.spec.controller
        assert {text.partition("=")[0] for text in job.spec.set} <= set(scene.settings.paths())


@pytest.mark.parametrize("quick", QUICK)
@pytest.mark.parametrize("name", ITEMS)
def test_failed_runs_do_not_stop_a_report(name: str, quick: bool, tmp_path: Path) -> None:
    """If every run failed, there is still a report, without computed numbers and without a passed check."""
    item = ITEMS[name]
    jobs = item.jobs(quick)
    section = item.report(failed(jobs), quick)
    if jobs:
        assert all(math.isnan(row.ours) for row in section.rows)
        assert not any(check.holds for check in section.checks)
    write([Report(item, section, ())], tmp_path, quick)
    assert {f"{picture.name}.png" for picture in section.pictures} <= {p.name for p in tmp_path.iterdir()}


@pytest.mark.parametrize("name", ITEMS)
def test_quick_runs_are_no_longer_than_the_others(name: str, prepared: dict[RunSpec, Scene]) -> None:
    """With --quick an item simulates no more seconds than without it."""

    def seconds(quick: bool) -> float:
        return sum(prepared[job.spec].duration for job in set(ITEMS[name].jobs(quick)))

    assert seconds(True) <= seconds(False)


@pytest.mark.parametrize("name", ["himpc-table-1", "himpc-table-4"])
def test_the_scenes_have_the_gains_of_the_paper(name: str) -> None:
    section = ITEMS[name].report({}, False)
    assert section.rows
    assert all(row.ratio == 1.0 for row in section.rows)


@pytest.mark.parametrize("number", range(1, 9))
def test_every_table_has_its_printed_values(number: int) -> None:
    assert printed(f"himpc_table_{number}")


def test_printed_values_are_what_the_paper_prints() -> None:
    """One number per table equals the value that was read from the paper independently a second time."""
    assert printed("himpc_table_2")["hqp"] == {"x": 3.11e-3, "y": 2.39e-3, "q1": 1.05}
    assert printed("himpc_table_3")["Input constraints"]["hqp"] is True
    assert printed("himpc_table_5")["disturbed"]["orientation"] == [3.388e-2, 2.290e-2, 2.122e-1]
    assert printed("himpc_table_6")["nhimpc"]["20"] == 1.598
    assert printed("himpc_table_7")["himpc"]["median"] == 9.04e-3
    assert printed("himpc_table_8")["smoothness"][3] == 11.62


# -------------------------------------------------------------------------------- verdicts


def fake(job: Job, error: float, torque: float, speed: float, lost: float | None = None) -> JobResult:
    """Returns a result with a given error of level 1 (m) and given ratios to the bounds."""
    task = {"name": "position", "rmse_after_1s": [error, error / 2], "rmse": [error, error / 2]}
    limits = {"torque": {"max_ratio": torque}, "velocity": {"max_ratio": speed}}
    data: dict[str, Any] = {"diverged": lost is not None, "diverged_at_s": lost, "tasks": [task]}
    return JobResult(job, {**data, "limits": limits}, {"error/position": np.full((4, 2), error)})


def ticks(error: float, torque: float, speed: float, lost: float | None = None) -> dict[str, bool | None]:
    """Returns the verdicts for three runs with equal results."""
    runs = {make("himpc"): fake(make("himpc"), error, torque, speed, lost) for make in (rt1, rt2, rt3)}
    return {name: verdict.holds for name, verdict in verdicts(runs, "himpc").items()}


def test_ticks_are_decided_by_the_runs() -> None:
    """Each property depends on its own number, and failed runs decide none of them."""
    assert ticks(1e-5, 1.0, 1.0) == dict.fromkeys(CRITERIA, True)
    assert ticks(1e-3, 1.0, 1.0)["High accuracy"] is False
    assert ticks(0.05, 1.0, 1.0)["Singularity-free"] is False
    assert ticks(1e-5, 5.0, 1.0)["Singularity-free"] is False
    assert ticks(1e-5, 1.0, 1.0, lost=0.5)["Singularity-free"] is False
    assert ticks(1e-5, 1.01, 1.0)["Input constraints"] is False
    assert ticks(1e-5, 1.0, 1.1)["State constraints"] is False
    missing = failed(make("himpc") for make in (rt1, rt2, rt3))
    assert {verdict.holds for verdict in verdicts(missing, "himpc").values()} == {None}
    assert {verdict.tick for verdict in verdicts(missing, "himpc").values()} == {"–"}


@pytest.mark.parametrize(
    ("row", "ratio", "remark"),
    [
        (Row("x", "m", 2.0, 2.1, "why"), 1.05, "agrees within 10%"),
        (Row("x", "m", 2.0, 4.0, "why"), 2.0, "why"),
        (Row("x", "m", None, 4.0, "why"), None, "why"),
        (Row("x", "m", 2.0, math.nan, "why"), None, "why"),
    ],
)
def test_a_row_says_why_unless_it_agrees(row: Row, ratio: float | None, remark: str) -> None:
    assert row.ratio == ratio
    assert row.remark == remark


def test_nothing_measured_is_no_check_passed() -> None:
    assert not at_most("x", math.nan, 1.0).holds
    assert at_most("x", 1.0, 1.0).holds


# -------------------------------------------------------------------------------- runs


def test_jobs_run_anywhere_give_the_same_numbers(short: dict[str, JobResult]) -> None:
    """A spawned process and this process compute bitwise equal results, and the arrays have one row per
    tick."""
    run = short["himpc"]
    again = run.job.do()
    assert np.array_equal(run["tau"], again["tau"])
    assert run.error_of("position", 1) == again.error_of("position", 1) > 0
    assert len(run.t) == 1200


def test_a_job_that_cannot_be_done_is_a_run_with_a_sentence() -> None:
    job = Job(RunSpec("planar3-circle", controller="himcp", duration=0.01))
    run = perform_all([job])[job]
    assert run.error is not None
    assert "himpc" in run.error
    assert math.isnan(run.error_of("position"))
    assert len(run.t) == 0


def test_the_incremental_model_is_better_than_a_model_20_percent_off(short: dict[str, JobResult]) -> None:
    """With the definitions of section III-B, γ of (21) is at least ten times as large as δ of (25)."""
    errors = model_errors(short["himpc"])
    assert errors.gamma > 10 * errors.delta > 0
    assert errors.beta > 10 * errors.epsilon > 0


def test_an_exact_nominal_model_has_no_error() -> None:
    """γ vanishes if the nominal model agrees with the plant; its definition measures only the model error."""
    exact = tuple(
        f"nominal.{key}" for key in ("mass_scale=1", "inertia_scale=1", "armature=[0.05,0.05,0.03]")
    )
    bare = ("plant.friction=0", "plant.damping=0")
    job = Job(RunSpec("planar3-circle", controller="himpc", set=(*exact, *bare), duration=1.2))
    wrong = Job(RunSpec("planar3-circle", controller="himpc", set=bare, duration=1.2))
    # The remaining difference is the change of M and C within one tick.
    assert model_errors(job.do()).gamma < 0.01 * model_errors(wrong.do()).gamma


def test_smoothness_is_the_rms_distance() -> None:
    job = Job(RunSpec("planar3-circle", controller="himpc"))
    one = JobResult(job, {}, {"t": np.zeros((4, 1)), "tau": np.zeros((4, 2))})
    other = JobResult(job, {}, {"t": np.zeros((3, 1)), "tau": np.array([[3.0, 4.0]] * 3)})
    assert smoothness(other, one) == 5.0


def test_the_decrease_of_the_value_function_is_measured() -> None:
    """For a geometric decay, the measured rate is the rate of the decay; with one increase far from the
    reference, the rate is negative."""
    t = np.array([1e-3 * k for k in range(2000)])
    V = np.maximum(100.0 * 0.9 ** np.arange(len(t)), 1e-3)
    epsilon, alpha = decrease(V, t)
    assert epsilon == 1e-3
    assert alpha == pytest.approx(0.1, abs=0.01)
    V[20] = 2 * V[19]
    assert decrease(V, t)[1] < 0


def test_weighing_the_torque_costs_accuracy_where_gravity_pulls() -> None:
    """Section IV-C: at rest the weight on ‖Δτ‖² causes no error for any R; the weight on ‖τ‖² causes an error
    that increases with R."""
    still = EffortJob(
        RunSpec("iiwa14-circle", controller="himpc", duration=1.2),
        hold_deg=(0.0, 90.0, 0.0, 10.0, 0.0, 10.0, 0.0),
    )
    assert still.do().error_of("position") < 1e-9
    errors = [replace(still, effort="torque", R=R).do().error_of("position") for R in (1e-4, 1e-2)]
    assert 1e-6 < errors[0] < 0.1 * errors[1]


# -------------------------------------------------------------------------------- writing


def picture(name: str) -> Picture:
    x = np.linspace(0.0, 1.0, 50)
    panels = (
        Panel(
            "y (m)",
            (PlotCurve(x, x, "a", "himpc"), PlotCurve(x, -x, "b", "reference", "dots")),
            bounds=(-2, 2),
        ),
        Panel("y (m)", (PlotCurve(x[:5] + 1, x[:5] + 1, colour="0"),), "x (m)", log_x=True, log_y=True),
        Panel("y (m)", (PlotCurve(x, x),), "x (m)", equal=True, y_range=(0.0, 0.5)),
        Bars("c", ("one", "two"), (("HIMPC", "himpc", (1.0, 1e3)), ("HQP", "hqp", (math.nan, 2.0)))),
        Panel("nothing", ()),
    )
    return Picture(name, "what is seen", panels, 2)


def test_a_report_holds_what_was_measured(tmp_path: Path) -> None:
    """report.md, results.json and the picture agree with the section; NaN is written as null."""
    section = Section(
        notes=("A note.",),
        rows=(Row("x", "m", 2.0, 4.0, "differs | because"), Row("y", "m", None, math.nan, "none")),
        tables=(Table("T", ("a", "b"), (("1", "2"),)),),
        checks=(PaperCheck("holds", 1.0, True), PaperCheck("does not", math.nan, False)),
        pictures=(picture("seen"),),
    )
    item = Item("test-1", "A title", "a source", lambda quick: (), lambda results, quick: section)
    (report,) = reproduce([item])
    assert not report.sound
    write([report], tmp_path, quick=False)
    data = json.loads((tmp_path / "results.json").read_text())
    assert data == json.loads(json.dumps(as_data([report], False)))
    assert data["items"][0]["rows"][0] == {
        "quantity": "x",
        "unit": "m",
        "paper": 2.0,
        "ours": 4.0,
        "ratio": 2.0,
        "verdict": "differs",
        "within": 0.1,
        "remark": "differs | because",
        "topic": "",
    }
    assert data["items"][0]["rows"][1]["ours"] is None
    text = (tmp_path / "report.md").read_text()
    assert "| x | m | 2 | 4 | 2 | differs | differs \\| because |" in text
    assert "1 differ" in text and "| x | m | 2 | 4 | 2 | differs |" in text
    assert "1 of 2 checks hold" in text
    assert "✗ does not" in text
    assert (tmp_path / "seen.png").read_bytes().startswith(b"\x89PNG")


def test_items_share_their_runs(short: dict[str, JobResult]) -> None:
    """Two items that need the same job receive the same result."""
    job = Job(replace(short["himpc"].job.spec, duration=0.01))
    seen: list[JobResult] = []

    def report(results: Results, quick: bool) -> Section:
        seen.append(results[job])
        return Section()

    items = [Item(name, "", "", lambda quick: (job, job), report) for name in ("a", "b")]
    reproduce(items)
    assert seen[0] is seen[1]
    assert seen[0].error is None


def test_a_folder_that_cannot_be_written_is_one_sentence(tmp_path: Path) -> None:
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="--out"):
        write([], tmp_path / "file", quick=False)
