"""The settings of the velocity-level scenes, events as data, the output of a run, and the items of the paper
are tested."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from velocity_runs import HOME, scene

from himpc.missions import Go
from lessons.events import (
    Appear,
    Event,
    InsertTask,
    MoveTarget,
    Push,
    Release,
    RemoveTask,
    Reset,
    Set,
    as_data,
    from_data,
)
from lessons.papers import ITEMS
from lessons.papers.htmpc_paper.runs import square
from lessons.papers.htmpc_paper.squares import collinear
from lessons.papers.words import printed
from lessons.recording.arrays import arrays
from lessons.recording.run import Recording, run
from lessons.scenes.catalog import load_scene, prepared
from lessons.session.velocity import VelocitySession
from lessons.settings.missions import random_peaks
from robots import InputError


def test_every_setting_can_be_set_and_a_typo_names_the_nearest() -> None:
    """Numbers, words, lists and null are assigned with the same paths as on the command line."""
    settings = scene("ridgeback-ur10-delivery").settings
    for path, value, found in (
        ("horizon", 12, lambda s: s.htmpc.horizon),
        ("delta_m", 0.002, lambda s: s.htmpc.delta_m),
        ("levels.2.enabled", False, lambda s: s.htmpc.stack[1].enabled),
        ("levels.base.Q", 3.0, lambda s: s.htmpc.stack[1].Q),
        ("limits.velocity_scale", 0.5, lambda s: s.htmpc.limits.velocity_scale),
        ("plant.mode", "servo", lambda s: s.plant.mode),
        ("hold_s", None, lambda s: s.options.hold_s),
        ("architecture", "single_task", lambda s: s.options.architecture),
        ("input_effort", [0.1] * 9, lambda s: list(s.htmpc.input_effort)),
    ):
        assert found(settings.changed(path, value)) == value
    assert len(set(settings.paths())) == len(settings.paths()), "no path means two things"
    assert set(settings.paths()) >= {"seats", "rounds", "formulation", "lexicographic", "rate_hz", "Q"}
    for path, value, says in (
        ("delta", 1.0, "'delta_m'"),
        ("seats", [7], "0 to 5"),
        ("seats", 3, "give a list"),
        ("horizon", 2.5, "whole number"),
        ("architecture", "hierarchic", "'hierarchical'"),
        ("controller", "htmcp", "'htmpc'"),
        ("levels.2.enabled", 1, "true or false"),
        ("plant.mode", "srvo", "'servo'"),
    ):
        with pytest.raises(InputError, match=says):
            settings.changed(path, value)


def test_a_formulation_and_a_controller_bring_what_they_were_tuned_with() -> None:
    """Formulation A has stage weight 1, and the default formulation has 10; HTIDKC runs at 50 Hz."""
    settings = scene("ridgeback-ur10-square").settings
    paper = settings.changed("formulation", "paper")
    assert [level.Q for level in settings.htmpc.stack] == [10.0, 10.0]
    assert [level.Q for level in paper.htmpc.stack] == [1.0, 1.0]
    assert settings.changed("controller", "htidkc").htmpc.rate_hz == 50.0


def test_a_controller_of_the_other_kind_is_refused_with_a_way_out() -> None:
    for name, controller in (("ridgeback-ur10-square", "himpc"), ("iiwa14-hold", "htmpc")):
        with pytest.raises(InputError, match="choose one of"):
            prepared(load_scene(name), controller, ())


def test_what_is_wrong_with_an_event_is_a_notice_and_the_run_goes_on() -> None:
    session = VelocitySession(scene("ridgeback-ur10-drag"))
    for event in (
        MoveTarget("bse", (0.0, 0.0)),
        MoveTarget("base", (float("nan"), 0.0)),
        Set("delta_m", -1.0),
        Set("horizn", 5),
        InsertTask("x", "head", (0.0, 0.0)),
        Push("base", (1.0, 0.0, 0.0)),
        Release("nobody"),
        Appear("ball", (0.0, 0.0, 1.0), -1.0),
    ):
        session.post(event)
    row = session.tick()
    assert len(session.notices) == 8
    assert np.isfinite(row[session.layout.fields["tau"]]).all()
    session.post(Reset())
    session.tick()
    assert session.t == pytest.approx(0.1)


def test_settings_of_which_the_plant_refuses_one_do_not_change_the_controller() -> None:
    session = VelocitySession(scene("ridgeback-ur10-drag"))
    session.tick()
    now, controller, plant = session.settings, session.controller, session.plant.settings
    wrong = replace(now.plant, payload_kg=5.0, friction=(0.1, 0.2))
    with pytest.raises(InputError, match="friction has 2 values"):
        session.adopt(replace(now, controller="htidkc", plant=wrong))
    assert session.controller is controller
    assert session.settings == now
    assert session.plant.settings == plant


@pytest.mark.parametrize(
    "event",
    [
        Release("ee 1"),
        InsertTask("x", "ee", (1.0, 2.0, 3.0), before="y", hold=None),
        RemoveTask("x"),
        Appear("ball", (0.0, 0.0, 1.0), 0.2),
        MoveTarget("base", (0.0, 1.0)),
        Set("delta_m", 0.1),
    ],
)
def test_events_survive_as_data(event: Event) -> None:
    """An event is equal after it was stored in a recording and read again."""
    assert from_data(as_data(event)) == event


def test_the_arrays_hold_one_row_per_tick_and_how_to_repeat_the_run() -> None:
    recording = run(scene("ridgeback-ur10-square"), 1.0)
    assert isinstance(recording, Recording)
    data = arrays(recording, {"scene": "ridgeback-ur10-square"})
    for name in ("t", "q", "v", "tau", "v_limit", "x/ee", "x_d/base", "v_d/base", "a_d/ee", "error/base"):
        assert len(data[name]) == 10
    assert list(data["level/base"]) == [2.0] * 10
    assert data["joint_names"].size == 9
    np.testing.assert_allclose(np.diff(data["t"]), 0.1)


def test_a_waypoint_is_a_goal_without_a_speed() -> None:
    """The missions of the options are data that can be read without a run."""
    mission = scene("ridgeback-ur10-delivery").settings.options.mission({})
    assert [task.role for task in mission[:4]] == ["base", "ee", "base", "ee"]
    assert len(mission) == 24
    assert isinstance(mission[1].motion, Go)
    assert mission[1].motion.cruise is None


# ---------------------------------------------------------------- the paper


def test_the_papers_table_and_figures_can_be_asked_for() -> None:
    """Table I, Figs. 3 to 9 and the computing times of the paper are items."""
    assert {"htmpc-table-1", "htmpc-times", *(f"htmpc-fig-{k}" for k in range(3, 10))} <= set(ITEMS)
    assert printed("htmpc_table_1")["cost"]["high"] == {"avg": 6.25, "std": 2.73}
    assert printed("htmpc_table_1")["per_coordinate"]["low"] == {"avg": 3.07, "std": 0.73}


def test_random_peaks_are_out_of_reach_and_near_enough() -> None:
    """Peaks are 1.83 m + 0.25 to 0.5 m from the EE, less than 3 m from the origin, and equal for equal
    seeds."""
    peaks = np.array(random_peaks(3, 25, HOME))
    away = np.linalg.norm(peaks - HOME, axis=1)
    assert (away >= 1.83 + 0.25 - 1e-9).all()
    assert (away <= 1.83 + 0.5 + 1e-9).all()
    assert (np.linalg.norm(peaks, axis=1) < 3.0).all()
    assert random_peaks(3, 25, HOME) == random_peaks(3, 25, HOME)
    assert random_peaks(4, 25, HOME) != random_peaks(3, 25, HOME)


def test_collinear_waves_are_those_on_the_line_through_hand_and_home() -> None:
    """A wave straight behind the base or beyond the hand is collinear, but one to the side is not."""
    behind, side = HOME - 2.2 * HOME / np.linalg.norm(HOME), HOME + np.array([0.0, 2.2])
    assert collinear(square("htmpc", tuple(behind.tolist())))
    assert collinear(square("htmpc", tuple((HOME + 2.2 * HOME / np.linalg.norm(HOME)).tolist())))
    assert not collinear(square("htmpc", tuple(side.tolist())))


def test_priorities_can_be_a_setting() -> None:
    """`order` takes effect when a run starts; a wrong value is refused in a sentence with the valid form."""
    drag = scene("ridgeback-ur10-drag", "order=base,ee")
    session = VelocitySession(drag)
    session.tick()
    assert [active.task.role for active in session.progress.window] == ["base", "ee"]
    session.post(Set("order", ["ee", "base"]))
    session.tick()
    assert [active.task.role for active in session.progress.window] == ["base", "ee"]
    session.post(Reset())
    session.tick()
    assert [active.task.role for active in session.progress.window] == ["ee", "base"]
    for wrong in ("base", "base,base", "base,nose", 3):
        with pytest.raises(InputError, match="every level once"):
            drag.settings.changed("order", wrong)
    with pytest.raises(InputError, match="order"):
        scene("ridgeback-ur10-delivery").settings.changed("order", "base,ee")
