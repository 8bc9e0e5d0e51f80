"""The scene reports a crate at a wrong place: the robot makes way for it and comes back."""

from __future__ import annotations

import re
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from velocity_runs import scene

from lessons.events import Reset, Set
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import load_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.velocity import VelocitySession
from lessons.settings.missions import CRATE
from robots import InputError
from robots.collision import Box

ROOT = Path(__file__).parents[2]
NAME = "ridgeback-ur10-perception"
ON_THE_WAY = ("obstacles.crate=[1.9,0.3,0.25]", "report_offset=[0,1.1,0]")
KEPT = 0.05 - 0.01
"""Distance that must be kept, m: the margin of 5 cm, of which 1 cm may be lost between two knots."""


@cache
def told(*settings: str, controller: str = "htmpc") -> dict[str, Any]:
    spec = RunSpec(NAME, controller=controller, set=settings, duration=12.0)
    return summary(run(spec.prepared()))


def session() -> VelocitySession:
    return VelocitySession(scene(NAME))


def crate_told(running: VelocitySession) -> tuple[float, ...]:
    """Returns the place of the crate that the controller receives, m."""
    assert running.controller is not None
    (crate,) = [each for each in running.controller.settings.obstacles if isinstance(each, Box)]
    assert crate.name == CRATE
    return crate.centre


def test_the_robot_makes_way_for_what_is_reported_and_comes_back() -> None:
    found = told()
    base, hand = found["report"]["base"], found["report"]["ee"]
    assert base["max_before_m"] < 0.005
    assert 0.5 < base["max_wrong_m"] < 0.62
    assert base["end_m"] < 0.005
    assert max(hand["max_wrong_m"], hand["max_after_m"]) < 1e-3
    assert found["clearance_min_m"] > 0.4
    assert KEPT <= found["clearance_reported_min_m"] < 0.06
    assert (found["solver"]["unsolved"], found["solver"]["fallbacks"]) == (0, {})


def test_without_a_false_report_nobody_makes_way() -> None:
    found = told("false_report=false")
    assert found["report"] is None
    assert found["clearance_min_m"] == found["clearance_reported_min_m"]
    assert found["clearance_min_m"] > 0.6
    assert max(found["tasks"][1]["max_abs"]) < 0.005


def test_a_crate_that_is_reported_right_is_never_touched() -> None:
    """This also holds if the crate is on the way, and if its place becomes known when the robot is one metre
    away."""
    for settings in (("obstacles.crate=[1.9,0.3,0.25]", "false_report=false"), (*ON_THE_WAY, "report_end=5")):
        assert told(*settings)["clearance_min_m"] >= KEPT


def test_a_crate_where_none_is_reported_is_run_into() -> None:
    """The controller receives a wrong place. The scene has no contacts, so the robot drives through the
    crate."""
    found = told(*ON_THE_WAY)
    assert found["clearance_min_m"] < -0.3
    assert found["report"]["base"]["max_wrong_m"] < 0.005


def test_rivals_run_in_it_too() -> None:
    """HTIDKC does not consider obstacles. If the hand is the only task, the base does not come back."""
    blind, single = told(controller="htidkc"), told(controller="stmpc")
    assert blind["clearance_reported_min_m"] < -0.3
    assert blind["report"]["base"]["max_wrong_m"] < 0.02
    assert single["clearance_reported_min_m"] >= KEPT
    assert single["report"]["base"]["end_m"] > 0.5
    assert single["report"]["ee"]["max_wrong_m"] > 0.1


def test_the_controller_gets_the_report_and_the_rows_have_both_distances() -> None:
    running = session()
    fields = running.layout.fields
    running.adopt(running.settings.changed("report_start", 0.2).changed("report_end", 0.4))
    places, distances = [], []
    for _ in range(5):
        row = running.tick()
        places.append(crate_told(running))
        distances.append((row[fields["clearance"]][0], row[fields["clearance_reported"]][0]))
    true, wrong = (1.9, 1.4, 0.25), (1.9, 1.4 - 1.1, 0.25)
    assert places == [true, true, wrong, wrong, true]
    assert [bool(a == b) for a, b in distances] == [True, True, False, False, True]
    assert distances[2][1] < distances[2][0]
    assert running.settings.htmpc.obstacles == running.scene.settings.htmpc.obstacles


def test_a_crate_that_is_moved_is_reported_beside_its_new_place() -> None:
    running = session()
    running.post(Set("obstacles.crate", (2.5, 1.0, 0.25)))
    running.post(Set("report_start", 0.0))
    running.tick()
    np.testing.assert_allclose(crate_told(running), (2.5, -0.1, 0.25))
    running.post(Set("obstacles.crate", None))
    running.tick()
    assert running.notices == []
    running.post(Reset())
    running.tick()
    assert running.notices == []


def test_wrong_settings_of_the_report_are_refused() -> None:
    settings = load_scene(NAME).settings
    with pytest.raises(InputError, match=r"report_offset has 2 numbers: give x, y and z"):
        settings.changed("report_offset", [1.0, 2.0])
    with pytest.raises(InputError, match="report_offset"):
        settings.changed("report_offset", [0.0, float("nan"), 0.0])
    with pytest.raises(InputError, match="report_start"):
        settings.changed("report_start", -1.0)
    assert settings.changed("report_offset.2", 0.5).value_at("report_offset") == (0.0, 0.5, 0.0)


def test_the_results_page_has_what_is_measured() -> None:
    """For each row of the table there is a run."""
    runs = {
        "HTMPC": told(),
        "HTMPC, base first": told("order=base,ee"),
        "single task: the hand": told(controller="stmpc"),
        "HTIDKC": told(controller="htidkc"),
        "crate on the way": told(*ON_THE_WAY),
        "crate on the way, corrected at 5 s": told(*ON_THE_WAY, "report_end=5"),
        "crate on the way, corrected at 5.4 s": told(*ON_THE_WAY, "report_end=5.4"),
    }
    page = (ROOT / "docs/results.md").read_text(encoding="utf-8")
    for name, found in runs.items():
        base, hand = found["report"]["base"], found["report"]["ee"]
        spans = [base[f"max_{span}_m"] for span in ("before", "wrong", "after")] + [base["end_m"]]
        distances = [found["clearance_min_m"], found["clearance_reported_min_m"]]
        lost = 1e3 * max(hand[f"max_{span}_m"] for span in ("before", "wrong", "after"))
        (row,) = re.findall(rf"^\| {re.escape(name)} \| (.+) \|$", page, re.MULTILINE)
        *metres, millimetres = (float(cell.replace("−", "-")) for cell in row.split(" | "))
        assert metres == pytest.approx([*distances, *spans], rel=0.01, abs=2e-3), name
        assert millimetres == pytest.approx(lost, rel=0.02, abs=0.2), name
