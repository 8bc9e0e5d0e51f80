"""Missions: planned motion is continuous and keeps its speed; the task manager shows the right tasks at the
right time."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from himpc.missions import Follow, Go, MissionTask, Progress, advanced, insert, move, release, remove, reorder
from himpc.references import Hold, Law, Path, SquareWave, Started
from robots import InputError

Array = NDArray[np.float64]

coordinate = st.floats(-10, 10, allow_subnormal=False)
point = st.tuples(coordinate, coordinate, coordinate)
paths = st.builds(
    lambda points, cruise, law, start: Path(np.array(points), cruise, law, start),
    st.lists(point, min_size=1, max_size=5),
    st.floats(0.05, 3.0),
    st.sampled_from(("straight", "quintic")),
    st.floats(-5, 5),
)


# ---------------------------------------------------------------- planners


@given(path=paths, t=st.floats(-10, 60))
def test_a_path_keeps_to_its_cruise_speed(path: Path, t: float) -> None:
    """The velocity of the preview and the motion between two times stay within the cruise speed."""
    T_s, N = 0.01, 20
    preview = path.preview(t, T_s, N)
    assert np.linalg.norm(preview.velocity, axis=1).max() <= path.cruise * (1 + 1e-9)
    steps = np.linalg.norm(np.diff(preview.displacement, axis=0), axis=1)
    assert steps.max() <= path.cruise * T_s * (1 + 1e-6) + 1e-9


@given(path=paths)
def test_a_path_runs_from_its_first_to_its_last_point_and_stays(path: Path) -> None:
    """Before the start and after the end the path is constant at its end points."""
    for t, end in ((path.start - 1.0, 0), (path.start, 0), (path.start + path.duration, -1), (1e4, -1)):
        preview = path.preview(t, 1e-9, 1)
        np.testing.assert_allclose(preview.value, path.points[end], atol=1e-6)
    assert not path.preview(path.start + path.duration + 1e-6, 0.1, 3).displacement.any()
    assert not path.preview(path.start + path.duration + 1e-6, 0.1, 3).velocity.any()


@given(path=paths, part=st.floats(0, 1))
def test_the_velocity_of_a_path_is_that_of_its_motion(path: Path, part: float) -> None:
    """Away from the corners of a straight path, ẋ_d is the difference quotient of x_d."""
    t, h = path.start + part * path.duration, 1e-5
    before, now, after = (path.preview(t + dt, h, 0) for dt in (-h, 0.0, h))
    quotient = (after.value - before.value) / (2 * h)
    corner = path.law == "straight" and np.abs(after.velocity - before.velocity).max() > 1e-12
    if not corner:
        np.testing.assert_allclose(now.velocity[0], quotient, atol=1e-2 * path.cruise + 1e-6)


def test_a_quintic_segment_starts_and_ends_softly() -> None:
    """Velocity and acceleration are zero at both ends, and the speed in the middle is the cruise speed."""
    path = Path(np.array([[0.0, 0.0], [3.0, 4.0]]), 0.5)
    for t in (0.0, path.duration):
        preview = path.preview(t, 0.1, 0)
        np.testing.assert_allclose(preview.velocity, 0.0, atol=1e-9)
        np.testing.assert_allclose(preview.acceleration, 0.0, atol=1e-9)
    middle = path.preview(path.duration / 2, 0.1, 0).velocity[0]
    assert np.linalg.norm(middle) == pytest.approx(0.5)


def test_a_straight_path_takes_length_over_speed() -> None:
    """5 m at 0.5 m/s take 10 s, and corners need no additional time."""
    assert Path(np.array([[0.0, 0.0], [3.0, 4.0]]), 0.5, "straight").duration == pytest.approx(10.0)
    bent = Path(np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 2.0]]), 0.5, "straight")
    assert bent.duration == pytest.approx(6.0)
    np.testing.assert_allclose(bent.preview(3.0, 0.1, 0).value, [1.0, 0.5])


@pytest.mark.parametrize(
    ("points", "cruise", "law", "says"),
    [
        ([[0.0, 0.0]], 0.0, "quintic", "cruise speed is 0.0"),
        ([[0.0, 0.0]], math.nan, "quintic", "cruise speed is nan"),
        ([[0.0, math.inf]], 1.0, "quintic", "finite"),
        ([[0.0, 0.0]], 1.0, "quintc", "'quintic'"),
    ],
)
def test_a_path_that_cannot_be_is_refused(
    points: list[list[float]], cruise: float, law: Law, says: str
) -> None:
    """The message is one sentence that names the fault."""
    with pytest.raises(InputError, match=says):
        Path(np.array(points), cruise, law)


def test_a_square_wave_switches_on_time_and_is_seen_coming() -> None:
    """The wave has its peak, then its valley; the preview shows the step before it happens."""
    wave = SquareWave(np.array([1.0, 2.0]), np.zeros(2), half_period=8.0, waves=1)
    ahead = wave.preview(7.5, 0.1, 10)
    np.testing.assert_array_equal(ahead.value, [1.0, 2.0])
    np.testing.assert_array_equal(ahead.displacement[4], [0.0, 0.0])
    np.testing.assert_array_equal(ahead.displacement[5], [-1.0, -2.0])
    t = 0.0
    for _ in range(80):
        t += 0.1
    np.testing.assert_array_equal(wave.preview(t, 0.1, 0).value, [0.0, 0.0])
    np.testing.assert_array_equal(wave.preview(20.0, 0.1, 0).value, [0.0, 0.0])
    for_ever = SquareWave(np.array([1.0, 2.0]), np.zeros(2), half_period=8.0)
    np.testing.assert_array_equal(for_ever.preview(20.0, 0.1, 0).value, [1.0, 2.0])


def test_a_started_reference_has_its_own_clock() -> None:
    path = Path(np.array([[0.0], [1.0]]), 0.5)
    np.testing.assert_array_equal(
        Started(path, 3.0).preview(4.0, 0.1, 5).displacement, path.preview(1.0, 0.1, 5).displacement
    )


# ---------------------------------------------------------------- the manager

STILL = {"ee": 0.0, "base": 0.0}


def at(ee: float, base: float) -> Mapping[str, Array]:
    return {"ee": np.array([ee]), "base": np.array([base])}


def delivery(hold: float | None = 0.0, tolerance: float = 0.1) -> tuple[MissionTask, ...]:
    """Returns a mission: base to 1, EE to 2, base to 3, EE to 4."""
    return tuple(
        MissionTask(f"{role}{goal}", role, Go((goal,)), tolerance, hold)
        for role, goal in (("base", 1.0), ("ee", 2.0), ("base", 3.0), ("ee", 4.0))
    )


def names(progress: Progress) -> list[str]:
    return [active.task.name for active in progress.window]


def test_a_completed_task_hands_over_to_the_next() -> None:
    """The window starts at the first task that is not done, contains L tasks, and shrinks at the end."""
    progress = advanced(Progress(delivery()), 2, 0.0, at(0, 0), STILL)
    assert names(progress) == ["base1.0", "ee2.0"]
    progress = advanced(progress, 2, 1.0, at(0, 0.95), STILL)
    assert names(progress) == ["ee2.0", "base3.0"]
    assert progress.completed == (("base1.0", 1.0),)
    progress = advanced(progress, 2, 2.0, at(2, 3), STILL)
    assert names(progress) == ["ee4.0"]
    progress = advanced(progress, 2, 3.0, at(4, 3), STILL)
    assert progress.done
    assert names(progress) == ["ee4.0"], "the robot stays where it ended"


@given(
    L=st.integers(1, 4),
    steps=st.lists(st.tuples(st.sampled_from("eb"), st.integers(0, 5)), max_size=40),
)
def test_whatever_the_robot_does_the_window_is_the_next_L_tasks(L: int, steps: list[tuple[str, int]]) -> None:
    """Tasks are completed in order, one by one, and stay completed; no task is skipped or in the window
    twice."""
    mission = delivery()
    progress, ee, base = Progress(mission), 0.0, 0.0
    for k, (who, where) in enumerate(steps):
        ee, base = (float(where), base) if who == "e" else (ee, float(where))
        before = progress.l_0
        progress = advanced(progress, L, 0.1 * k, at(ee, base), STILL)
        assert progress.l_0 >= before
        assert [name for name, _ in progress.completed] == [task.name for task in mission[: progress.l_0]]
        if not progress.done:
            expected = mission[progress.l_0 : progress.l_0 + L]
            assert [active.task for active in progress.window] == list(expected)


def test_a_hold_counts_from_arrival_and_starts_again_when_the_point_leaves() -> None:
    """The hold is 0.5 s within the tolerance without interruption, while the task is first."""
    mission = (MissionTask("ee", "ee", Go((1.0,)), 0.1, hold=0.5), MissionTask("end", "base", Go((9.0,))))
    progress = Progress(mission)
    history = [(0.0, 1.0), (0.4, 1.05), (0.45, 1.2), (0.5, 1.0), (0.9, 1.0), (1.0, 1.0)]
    places = []
    for t, ee in history:
        progress = advanced(progress, 2, t, at(ee, 0), STILL)
        places.append(progress.l_0)
    assert places == [0, 0, 0, 0, 0, 1]


def test_being_at_the_goal_early_does_not_count_as_holding() -> None:
    """The EE reaches its goal while the base task is first; its hold begins later, when its task is first."""
    mission = (MissionTask("base", "base", Go((1.0,))), MissionTask("ee", "ee", Go((2.0,)), hold=1.0))
    progress = advanced(Progress(mission), 2, 0.0, at(2, 0), STILL)
    progress = advanced(progress, 2, 5.0, at(2, 1), STILL)
    assert progress.l_0 == 1
    assert not advanced(progress, 2, 5.9, at(2, 1), STILL).done
    assert advanced(advanced(progress, 2, 5.9, at(2, 1), STILL), 2, 6.0, at(2, 1), STILL).done


def test_a_full_stop_is_a_full_stop() -> None:
    """A task with `rest` is not completed while the point passes its goal."""
    progress = Progress((MissionTask("base", "base", Go((1.0,)), 0.05, rest=0.01),))
    progress = advanced(progress, 1, 0.0, at(0, 1), {"ee": 0.0, "base": 0.5})
    assert not progress.done
    assert advanced(progress, 1, 0.1, at(0, 1), {"ee": 0.0, "base": 0.009}).done


def test_a_hold_of_unknown_length_ends_with_its_release() -> None:
    """A task without a time of hold waits until it is released; after a release before the arrival, it is
    completed on arrival."""
    progress = Progress(delivery(hold=None)[:2])
    progress = advanced(progress, 2, 100.0, at(0, 1), STILL)
    assert progress.l_0 == 0
    progress = advanced(release(progress, "base1.0"), 2, 100.1, at(0, 1), STILL)
    assert progress.l_0 == 1
    progress = advanced(release(progress, "ee2.0"), 2, 100.2, at(0, 1), STILL)
    assert not progress.done
    assert advanced(progress, 2, 100.3, at(2, 1), STILL).done


def test_a_task_is_planned_from_where_its_point_is_when_it_enters() -> None:
    """The plan starts at the present position and not at that of the start of the mission; it is kept while
    the task stays in the window."""
    mission = (
        MissionTask("base", "base", Go((1.0,))),
        MissionTask("ee", "ee", Go((2.0,))),
        MissionTask("back", "base", Go((0.0,), cruise=0.5)),
    )
    progress = advanced(Progress(mission), 2, 0.0, at(0, 0), STILL)
    progress = advanced(progress, 2, 7.0, at(0, 1.01), STILL)
    back = progress.window[1].reference
    np.testing.assert_allclose(back.preview(7.0, 0.1, 0).value, [1.01])
    assert advanced(progress, 2, 8.0, at(0, 0.5), STILL).window[1].reference is back


def test_a_moved_task_is_planned_again_at_the_next_step() -> None:
    """The new plan starts at the present position and ends at the new goal; the other task in the window
    keeps its plan."""
    mission = (
        MissionTask("base", "base", Go((5.0,), cruise=0.5)),
        MissionTask("ee", "ee", Go((6.0,), cruise=0.5)),
    )
    progress = advanced(Progress(mission), 2, 0.0, at(0, 0), STILL)
    moved = advanced(move(progress, "base", (-5.0,)), 2, 2.0, at(1, 1), STILL)
    base = moved.window[0].reference
    np.testing.assert_allclose(base.preview(2.0, 0.1, 0).value, [1.0])
    np.testing.assert_allclose(base.preview(1e3, 0.1, 0).value, [-5.0])
    assert moved.window[1].reference is progress.window[1].reference


def test_a_task_inserted_before_the_running_one_comes_first() -> None:
    """A task inserted before the running one is first at the next step; one inserted at the end is last, also
    after all tasks were done."""
    progress = advanced(Progress(delivery()), 2, 0.0, at(0, 0), STILL)
    new = MissionTask("visit", "base", Go((-1.0,)), 0.1)
    first = advanced(insert(progress, new, before="base1.0"), 2, 0.1, at(0, 0), STILL)
    assert names(first) == ["visit", "base1.0"]
    done = advanced(Progress((MissionTask("only", "ee", Go((0.0,))),)), 2, 0.0, at(0, 0), STILL)
    assert done.done
    again = advanced(insert(done, new), 2, 0.1, at(0, 0), STILL)
    assert names(again) == ["visit"]
    assert advanced(remove(first, "visit"), 2, 0.2, at(0, 0), STILL).window[0].task.name == "base1.0"


def test_priorities_are_swapped_without_planning_anew() -> None:
    """The first two tasks change places; each keeps its plan."""
    progress = advanced(Progress(delivery()), 2, 0.0, at(0, 0), STILL)
    swapped = advanced(reorder(progress, "ee2.0", 0), 2, 0.1, at(0, 0), STILL)
    assert names(swapped) == ["ee2.0", "base1.0"]
    assert [active.reference for active in swapped.window] == [
        active.reference for active in reversed(progress.window)
    ]


def test_a_trajectory_is_completed_at_its_end_not_in_passing() -> None:
    """A closed trajectory is at its goal already at its start."""
    wave = SquareWave(np.array([1.0]), np.array([0.0]), half_period=1.0, waves=1)
    progress = Progress((MissionTask("wave", "base", Follow(wave, duration=2.0)),))
    for t, base, done in ((0.0, 1.0, False), (1.5, 0.0, False), (2.0, 0.5, False), (2.1, 0.0, True)):
        progress = advanced(progress, 1, t, at(0, base), STILL)
        assert progress.done is done
    endless = Progress((MissionTask("stay", "ee", Follow(Hold(np.zeros(1)))),))
    assert not advanced(endless, 1, 1e6, at(0, 0), STILL).done


def test_a_held_orientation_is_turned_and_goes_on_being_held() -> None:
    """A quaternion of any length for a quarter turn about z is accepted; other values are refused."""
    turn = MissionTask("turn", "ee", Follow(Hold(np.eye(3))), hold=None)
    progress = advanced(Progress((turn,)), 1, 0.0, {"ee": np.eye(3)}, STILL)
    moved = advanced(move(progress, "turn", (0.0, 0.0, 2.0, 2.0)), 1, 0.1, {"ee": np.eye(3)}, STILL)
    wanted = moved.window[0].reference.preview(5.0, 0.1, 0).value
    np.testing.assert_allclose(wanted, [[0, -1, 0], [1, 0, 0], [0, 0, 1]], atol=1e-12)
    assert not moved.done
    for wrong in ((0.0, 0.0, 0.0), (0.0,) * 4, (math.nan, 0.0, 0.0, 1.0)):
        with pytest.raises(InputError, match="quaternion x y z w"):
            move(progress, "turn", wrong)


def test_what_cannot_be_done_to_a_mission_is_refused_in_a_sentence() -> None:
    """Unknown or completed tasks, duplicate names, and goals that do not fit are refused in one sentence."""
    progress = advanced(Progress(delivery()), 2, 0.0, at(0, 1), STILL)
    assert progress.l_0 == 1
    wave = MissionTask("wave", "base", Follow(SquareWave(np.ones(1), np.zeros(1))))
    for change, says in (
        (lambda: move(progress, "bse3.0", (0.0,)), "'base3.0'"),
        (lambda: move(progress, "base1.0", (0.0,)), "is completed"),
        (lambda: move(progress, "ee2.0", (0.0, 1.0)), "needs 1 numbers, not 2"),
        (lambda: move(progress, "ee2.0", (math.nan,)), "not finite"),
        (lambda: move(insert(progress, wave), "wave", (0.0,)), "given trajectory"),
        (lambda: insert(progress, delivery()[3]), "occurs twice"),
        (lambda: insert(progress, wave, before="base1.0"), "is completed"),
        (lambda: release(progress, "ee2.0"), "waits 0 s at its goal"),
        (lambda: reorder(progress, "ee2.0", 3), "from 0 to 2"),
        (lambda: reorder(progress, "base1.0", 0), "is completed"),
        (lambda: remove(Progress((wave,)), "wave"), "at least one task"),
        (lambda: Progress(()), "at least one task"),
        (lambda: MissionTask("x", "ee", Go((0.0,)), tolerance=0.0), "tolerance of task 'x'"),
        (lambda: MissionTask("x", "ee", Go((0.0,)), hold=-1.0), "hold of task 'x'"),
        (lambda: MissionTask("x", "ee", Go((0.0,)), rest=0.0), "rest of task 'x'"),
        (lambda: Go((0.0,), via=((1.0,),)), "cruise speed"),
        (lambda: Go((0.0,), cruise=1.0, via=((1.0, 2.0),)), "needs 1 numbers"),
    ):
        with pytest.raises(InputError, match=says):
            change()
