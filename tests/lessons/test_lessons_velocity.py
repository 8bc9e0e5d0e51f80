"""Velocity-level scenes: the numbers of the HTMPC paper that the project promises, and live changes."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from himpc.htmpc.clearance import CollisionModel
from himpc.missions import Go
from lessons.events import (
    Appear,
    Event,
    InsertTask,
    MoveLevel,
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
from lessons.papers.printed import printed
from lessons.recording.arrays import arrays
from lessons.recording.recording import Recording
from lessons.recording.run import run
from lessons.recording.summary import summary
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.velocity_scene import VelocityScene
from lessons.session.velocity import VelocitySession
from lessons.settings.missions import random_peaks
from robots import InputError
from robots.collision import Ball

TIMING = ("step_ms", "real_time_factor")
HOME = np.array([1.48962656, 0.173941])


def scene(name: str, *assignments: str, controller: str | None = None) -> VelocityScene:
    found = prepared(load_scene(name), controller, assignments)
    assert isinstance(found, VelocityScene)
    return found


@lru_cache(maxsize=32)
def result(
    name: str, *assignments: str, controller: str | None = None, duration: float | None = None
) -> dict[str, Any]:
    return summary(run(scene(name, *assignments, controller=controller), duration))


def assert_sound(summary: dict[str, Any]) -> None:
    """Finite, inside velocity and acceleration limits, every QP solved."""
    assert summary["finite"] is True
    assert summary["diverged"] is False
    assert summary["solver"]["unsolved"] == 0
    assert summary["solver"]["max_kkt_residual"] <= 1e-6
    for kind in ("velocity", "acceleration"):
        assert summary["limits"][kind]["max_ratio"] <= 1.001


# ---------------------------------------------------------------- the paper's square waves


@pytest.mark.parametrize("peak", [f"peak={list(peak)}" for peak in random_peaks(0, 3, HOME)])
def test_the_hand_stays_while_the_base_goes_as_far_as_it_can(peak: str) -> None:
    """EE error within 1 mm on average and 10 mm at most; the base comes back to within 5 % and is prompt."""
    summary = result("ridgeback-ur10-square", peak)
    assert_sound(summary)
    away, back = summary["parts"]
    assert (away["name"], back["name"]) == ("peak", "valley")
    for part in (away, back):
        assert part["ee_error_mm"]["mean"] <= 1.0
        assert part["ee_error_mm"]["max"] <= 10.0
    assert away["normalised_base_error"] <= 0.6, "the base moved towards a peak it cannot reach"
    assert back["normalised_base_error"] <= 0.15
    assert back["final_base_error"] <= 0.05
    assert summary["priority_leak_max"] <= 0.01 + 1e-6, "no more than δ of (13)"


def test_preview_and_prediction_each_bring_the_base_home_sooner() -> None:
    """Part 2: HTMPC beats HTMPC_WPT (sees no step coming), which beats HTIDKC (does not predict)."""
    errors = {
        controller: result("ridgeback-ur10-square", controller=controller)["parts"][1][
            "normalised_base_error"
        ]
        for controller in ("htmpc", "htmpc_wpt", "htidkc")
    }
    assert errors["htmpc"] < errors["htmpc_wpt"] < errors["htidkc"]
    assert errors["htmpc"] <= 0.4 * errors["htidkc"]


def test_a_single_task_controller_leaves_the_base_where_it_is() -> None:
    """STMPC sees the first task of the window only."""
    summary = result("ridgeback-ur10-square", controller="stmpc", duration=4.0)
    assert summary["parts"][0]["normalised_base_error"] > 0.95


def test_the_same_run_gives_the_same_numbers_and_another_seed_other_noise() -> None:
    """To the bit; the seed is of the noise."""
    noisy = scene("ridgeback-ur10-square", "plant.position_noise=0.001")
    first, again, other = (run(noisy, 2.0, seed) for seed in (1, 1, 2))
    summaries = [
        {key: value for key, value in summary(run).items() if key not in TIMING} for run in (first, again)
    ]
    assert summaries[0] == summaries[1]
    np.testing.assert_array_equal(first["q"], again["q"])
    assert not np.array_equal(first["q"], other["q"])


def test_delay_compensation_holds_the_hand_stiller() -> None:
    """50 ms of servo lag and 1 mm of noise: EE mean below 5 mm with compensation, and worse without."""
    laggy = ("plant.lag_ms=50", "plant.position_noise=0.001")

    def mean(*more: str) -> float:
        parts = result("ridgeback-ur10-square", *laggy, *more)["parts"]
        return float(np.mean([part["ee_error_mm"]["mean"] for part in parts]))

    compensated = mean()
    assert compensated <= 5.0
    assert compensated < mean("compensate_delay=false")


# ---------------------------------------------------------------- missions


def test_two_tasks_at_a_time_deliver_faster_and_on_a_shorter_way() -> None:
    """One round of the delivery, one rule: the single-task architecture needs at least 1.5 times as long."""
    both = [
        result("ridgeback-ur10-delivery", "rounds=1", f"architecture={architecture}")
        for architecture in ("hierarchical", "single_task")
    ]
    for told in both:
        assert_sound(told)
        assert told["completed"] is True
    assert both[1]["completion_time_s"] >= 1.5 * both[0]["completion_time_s"]
    assert both[0]["base_path_m"] < both[1]["base_path_m"]


def test_the_hand_waits_for_a_person_and_the_base_does_not_leave_it() -> None:
    """The hold ends with the release, not before; meanwhile the base goes on and the hand stays."""
    recording = run(scene("ridgeback-ur10-handover"))
    told = summary(recording)
    assert_sound(told)
    done = {each["task"]: each["completed_s"] for each in told["mission"]}
    assert done["ee 1"] == pytest.approx(14.0)
    assert told["completed"] is True
    t = recording["t"][:, 0]
    waiting = (t > 5.0) & (t < 14.0)
    assert np.linalg.norm(recording["error/ee"][waiting], axis=1).max() <= 0.01
    base = recording["x/base"][waiting]
    assert np.linalg.norm(base[-1] - base[0]) > 0.2, "the base moved on while the hand waited"
    # The person's shift of the running task is followed.
    np.testing.assert_allclose(recording["x/ee"][-1], [-1.9, -0.4, 1.0], atol=0.02)


def test_a_running_task_that_is_moved_is_taken_up_at_the_next_step() -> None:
    """The reference of that very tick is the new one."""
    session = VelocitySession(scene("ridgeback-ur10-drag"))
    session.tick()
    session.post(MoveTarget("base", (-0.5, 0.3)))
    row = session.tick()
    np.testing.assert_array_equal(row[session.layout.fields["x_d/base"]], [-0.5, 0.3])
    session.post(InsertTask("detour", "ee", (1.4, 0.3, 0.8), before="ee"))
    row = session.tick()
    np.testing.assert_array_equal(row[session.layout.fields["x_d/ee"]], [1.4, 0.3, 0.8])
    session.post(RemoveTask("detour"))
    row = session.tick()
    np.testing.assert_allclose(row[session.layout.fields["x_d/ee"]][:2], HOME, atol=1e-6)
    assert session.notices == []


def test_swapping_the_priorities_lets_the_base_go() -> None:
    """Out of reach the base stops and the hand stays; swapped, the base goes and the hand is dragged."""
    target = np.array([-1.5, 0.0])
    session = VelocitySession(scene("ridgeback-ur10-drag"))
    fields = session.layout.fields
    session.post(MoveTarget("base", (-1.5, 0.0)))
    stopped = np.array([session.tick().copy() for _ in range(60)])
    assert np.linalg.norm(stopped[-1, fields["x/base"]] - target) > 0.5
    assert np.linalg.norm(stopped[:, fields["error/ee"]], axis=1).max() <= 0.01
    assert np.linalg.norm(stopped[-1, fields["v"]]) < 0.05
    session.post(MoveLevel("base", 0))
    gone = np.array([session.tick().copy() for _ in range(40)])
    assert np.linalg.norm(gone[-1, fields["x/base"]] - target) < 0.01
    assert np.linalg.norm(gone[-1, fields["error/ee"]]) > 0.3
    assert session.notices == []


# ---------------------------------------------------------------- obstacles, other robots


def test_obstacles_are_kept_clear_of() -> None:
    """The distance never falls below the margin by more than 1 cm, all the way."""
    told = result("ridgeback-ur10-cluttered")
    assert_sound(told)
    assert told["completed"] is True
    assert told["clearance_min_m"] >= 0.05 - 0.01


def test_an_obstacle_is_taken_away() -> None:
    """By its name, live as headless; what is not there cannot be."""
    session = VelocitySession(scene("ridgeback-ur10-cluttered"))
    session.post(Appear("surprise", (9.0, 9.0, 1.0), 0.2))
    session.tick()
    before = [each.name for each in session.settings.htmpc.obstacles]
    session.post(Set("obstacles.surprise", None))
    session.tick()
    assert [each.name for each in session.settings.htmpc.obstacles] == before[:-1]
    alone = prepared(scene("ridgeback-ur10-cluttered"), None, ["obstacles.table=null"])
    assert isinstance(alone, VelocityScene)
    assert "table" not in [each.name for each in alone.settings.htmpc.obstacles]
    with pytest.raises(InputError, match=r"no obstacle 'tabel': did you mean 'table'\?"):
        session.settings.changed("obstacles.tabel", None)


def test_a_ball_that_appears_ahead_is_not_run_into() -> None:
    """At full speed, 1 m from the nearest point of the robot, right on its way."""
    session = VelocitySession(scene("ridgeback-ur10-cluttered"))
    fields = session.layout.fields
    ahead = np.zeros(3)
    for _ in range(11):
        ahead = session.tick()[fields["x/ee"]].copy()
    assert session.plant.v[0] > 1.0

    def gap(x: float) -> float:
        ball = Ball("surprise", (x, float(ahead[1]), float(ahead[2])), 0.2)
        model = CollisionModel(session.robot, (ball,))
        return float(model.clearances(session.plant.q[None], 5.0, gradients=False).distance.min())

    x = float(ahead[0]) + 0.2
    while gap(x) < 1.0:
        x += 0.01
    session.post(Appear("surprise", (x, float(ahead[1]), float(ahead[2])), 0.2))
    distance = min(float(session.tick()[fields["clearance"]][0]) for _ in range(30))
    assert distance >= 0.05 - 0.01
    assert session.notices == []


@pytest.mark.parametrize("robot", ["iiwa14", "panda"])
def test_arms_settle_on_a_target_that_jumps(robot: str) -> None:
    """A step of 0.3 m ends below 1 mm, orientation kept, no bound left."""
    found = scene(f"{robot}-htmpc")
    session = VelocitySession(found)
    start = session.tick()[session.layout.fields["x/position"]].copy()
    goal = start + np.array([-0.15, 0.2, -0.1658])
    jump = replace(found, events=((0.1, MoveTarget("position", tuple(goal.tolist()))),))
    recording = run(jump, 4.0)
    told = summary(recording)
    assert_sound(told)
    assert told["limits"]["position"]["max_ratio"] <= 1.0
    assert np.linalg.norm(recording["error/position"][-1]) <= 1e-3


def test_the_same_robot_under_the_torque_controller_holds_its_hand_too() -> None:
    """HIMPC: the base target is dragged 0.5 m; EE RMSE within 2 mm, torques and speeds in their bounds."""
    found = load_scene("ridgeback-ur10-hold")
    told = summary(run(replace(found, events=((0.2, MoveTarget("base", (-0.3, 0.4))),)), 1.5))
    assert told["diverged"] is False
    assert told["solver"]["unsolved"] == 0
    assert np.linalg.norm(told["tasks"][0]["rmse"]) <= 2e-3
    assert told["limits"]["torque"]["max_ratio"] < 1.0
    assert told["limits"]["velocity"]["max_ratio"] <= 1.0


# ---------------------------------------------------------------- settings, events, output


def test_every_setting_can_be_set_and_a_typo_names_the_nearest() -> None:
    """Numbers, words, lists and null, by the same paths as on the command line."""
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
    """Formulation A has stage weight 1, the default 10; HTIDKC runs at 50 Hz."""
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
    """What a recording stores is the event."""
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
    """The options' missions are data that can be read without running them."""
    mission = scene("ridgeback-ur10-delivery").settings.options.mission({})
    assert [task.role for task in mission[:4]] == ["base", "ee", "base", "ee"]
    assert len(mission) == 24
    assert isinstance(mission[1].motion, Go)
    assert mission[1].motion.cruise is None


# ---------------------------------------------------------------- the paper


def test_the_papers_table_and_figures_can_be_asked_for() -> None:
    """Table I, Figs. 3 to 9 and the compute times."""
    assert {"htmpc-table-1", "htmpc-times", *(f"htmpc-fig-{k}" for k in range(3, 10))} <= set(ITEMS)
    assert printed("htmpc_table_1")["cost"]["high"] == {"avg": 6.25, "std": 2.73}
    assert printed("htmpc_table_1")["per_coordinate"]["low"] == {"avg": 3.07, "std": 0.73}


def test_random_peaks_are_out_of_reach_and_near_enough() -> None:
    """1.83 m + 0.25 to 0.5 m from the EE, less than 3 m from the origin, the same for the same seed."""
    peaks = np.array(random_peaks(3, 25, HOME))
    away = np.linalg.norm(peaks - HOME, axis=1)
    assert (away >= 1.83 + 0.25 - 1e-9).all()
    assert (away <= 1.83 + 0.5 + 1e-9).all()
    assert (np.linalg.norm(peaks, axis=1) < 3.0).all()
    assert random_peaks(3, 25, HOME) == random_peaks(3, 25, HOME)
    assert random_peaks(4, 25, HOME) != random_peaks(3, 25, HOME)


def test_collinear_waves_are_those_on_the_line_through_hand_and_home() -> None:
    """Straight behind the base or beyond the hand; not to the side."""
    behind, side = HOME - 2.2 * HOME / np.linalg.norm(HOME), HOME + np.array([0.0, 2.2])
    assert collinear(square("htmpc", tuple(behind.tolist())))
    assert collinear(square("htmpc", tuple((HOME + 2.2 * HOME / np.linalg.norm(HOME)).tolist())))
    assert not collinear(square("htmpc", tuple(side.tolist())))


def test_priorities_can_be_a_setting() -> None:
    """`order` is taken up when a run starts; what it must be is said."""
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
