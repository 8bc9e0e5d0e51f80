"""What ends the loop of an arm: its guard, a lost arm, a killed or hanging process."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_bench import ALONE, PATIENT, T_S, Bench, Scripted

from app.arm.drive import drive
from app.arm.guard import ArmGuard, Tolerances
from app.arm.loop import Ended
from app.link.process import wait_until
from robots.arms.arm import ArmLost, Reading


def test_missed_periods_end_the_loop_gently(bench: Bench) -> None:
    """Eleven missed periods in a row are too many. The arm is then stopped gently, as at every end."""

    def skip(k: int, arm: Scripted) -> None:
        if k == 200:
            arm.skipped += 11 * T_S

    ended, rows, at, arm = bench.run(skip)
    assert ended.why == "11 periods were missed one after another"
    assert ended.gently
    assert arm.stopped
    assert rows[:, at.missed].sum() == 11


def test_a_lost_connection_ends_the_loop(bench: Bench) -> None:
    """The reason contains the message of the arm, and the recorded rows are kept."""

    def lose(k: int, arm: Scripted) -> None:
        if k == 300:
            raise ArmLost("UDP receive: Timeout")

    ended, rows, _, arm = bench.run(lose)
    assert ended == Ended("the arm was lost: UDP receive: Timeout", False, 300)
    assert len(rows) == 300
    assert arm.stopped


def reading(v: float = 0.0, q: float = 0.0) -> Reading:
    return Reading(np.full(7, q), np.full(7, v), np.zeros(7), 0.0)


@pytest.mark.parametrize(
    ("each", "periods", "words"),
    [
        ({"missed": 11}, 1, "11 periods were missed one after another"),
        ({"missed": 1}, 1000, "% of the periods were missed during the last second"),
        ({"hurried": True}, 26, "changed too fast in 26 periods"),
        ({"fallback": 6}, 11, "no torque in 11 periods"),
        ({"reading": reading(v=2.4)}, 1, "joint 1 moves with 2.40 rad/s"),
        ({"reading": reading(q=float("nan"))}, 1, "not finite"),
        ({"beats": 7}, 502, "the watcher has been silent for 0.5 s"),
    ],
)
def test_the_guard_finds_every_reason_to_end(
    bench: Bench, each: dict[str, Any], periods: int, words: str
) -> None:
    """The guard reports each reason when it has lasted long enough, and not earlier. Without a reason it
    reports nothing."""
    calm = {"reading": reading(), "missed": 0, "hurried": False, "fallback": 0}
    guard, found = ArmGuard(bench.ready.limits, Tolerances(), T_S), None
    for k in range(periods):
        assert found is None, k
        found = guard.check(**{**calm, "beats": k, "now": k * T_S, **each})
        if "missed" in words and "last second" in words and found:
            break
    assert found is not None and words in found
    guard = ArmGuard(bench.ready.limits, Tolerances(), T_S)
    assert all(guard.check(**calm, beats=k, now=k * T_S) is None for k in range(2000))


def test_an_arm_far_from_its_model_is_stopped(bench: Bench) -> None:
    """A drive ends if the model is in another posture than the arm, and the reason names the joint."""
    driven = bench.drive(duration=60.0, tolerances=replace(PATIENT, distance=0.05), elsewhere=0.1)
    assert driven.why == "joint 2 is 0.10 rad away from the model"
    assert driven.gently
    assert not driven.wanted


def test_a_killed_loop_is_told_and_its_rows_stay(bench: Bench) -> None:
    """The process that watches the loop notices its end, and keeps the rows."""

    def die(k: int, arm: Scripted) -> None:
        if k == 100:
            os.kill(os.getpid(), signal.SIGKILL)

    driven = bench.drive(die, duration=20.0)
    assert driven.why == "the process of the loop ended (exit code -9)"
    assert not driven.gently
    assert len(driven.rows) == 100


def test_a_library_that_hangs_ends_the_loop_s_process(bench: Bench) -> None:
    """The loop's process ends if the arm's library does not answer for too long."""

    def hang(k: int, arm: Scripted) -> None:
        if k == 20:
            time.sleep(1000.0)

    wanted = bench.wanted(lambda: Scripted(bench.plant(), hang, T_S), stuck=0.5)
    driven = drive(wanted, bench.model(), lambda text: None)
    assert driven.why == f"the process of the loop ended (exit code {-signal.SIGALRM})"
    assert len(driven.rows) == 20


def test_a_watcher_that_hangs_delays_nothing(bench: Bench) -> None:
    """The loop notices that its watcher is silent, and stops the arm gently meanwhile."""
    over = multiprocessing.get_context("fork").Event()

    def hang(text: str) -> None:
        assert over.wait(60.0)

    class Ending(Scripted):
        def stop(self) -> None:
            super().stop()
            over.set()

    wanted = bench.wanted(lambda: Ending(bench.plant(), lambda k, arm: None, T_S), tolerances=ALONE)
    driven = drive(wanted, bench.model(), hang)
    assert "the watcher has been silent" in driven.why
    assert driven.gently


def test_a_killed_watcher_leaves_no_moving_arm(bench: Bench, tmp_path: Path) -> None:
    """If its watcher is killed, the loop continues until it has stopped the arm gently."""
    begun, over = tmp_path / "begun", tmp_path / "over"

    class Noting(Scripted):
        def stop(self) -> None:
            super().stop()
            over.write_text(str(os.getpid()))

    def note(k: int, arm: Scripted) -> None:
        if k == 5:
            begun.touch()

    def watch() -> None:
        wanted = bench.wanted(lambda: Noting(bench.plant(), note, T_S), tolerances=ALONE)
        drive(wanted, bench.model(), lambda text: None)

    watcher = multiprocessing.get_context("fork").Process(target=watch)
    watcher.start()
    assert wait_until(begun.exists, 60.0)
    watcher.kill()
    watcher.join()
    assert wait_until(over.exists, 60.0)
