"""In deadline mode, a late torque is applied one tick later. A run without the page never measures computing
times."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_rows import value

from lessons.events import MoveTarget, Reset, Set
from lessons.recording.run import run
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.commands import DelayedTorque
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments

ASIDE = ((0.01, MoveTarget("position", (0.6, 0.3))),)


@pytest.fixture(scope="module")
def planar() -> TorqueScene:
    return replace(torque_scene("planar3-hold"), events=ASIDE)


def with_settings(scene: TorqueScene, *assignments: str) -> TorqueScene:
    return replace(scene, settings=with_assignments(scene.settings, assignments))


@pytest.mark.parametrize(
    ("late", "applied"),
    [
        ([0, 0, 0], [1, 2, 3]),
        ([1, 0, 0], [0, 2, 3]),  # the previous torque is held, and the next one replaces the late one
        ([0, 1, 0], [1, 1, 3]),
        ([0, 1, 1, 0], [1, 1, 2, 4]),  # the second late tick applies the first one's torque
        ([1, 1, 1, 1], [0, 1, 2, 3]),  # every tick is late: the delay is one tick
        ([0, 1, 1, 0, 1], [1, 1, 2, 4, 4]),  # the waiting torque is discarded
    ],
)
def test_a_queue_of_one(late: list[int], applied: list[int]) -> None:
    """Tick k computes the torque k + 1; before the first tick the torque 0 acts."""
    outbox = DelayedTorque()
    found = [
        float(outbox.applied(np.array([k + 1.0]), bool(missed), np.zeros(1))[0])
        for k, missed in enumerate(late)
    ]
    assert found == applied


def test_always_late_is_one_tick_of_delay(planar: TorqueScene) -> None:
    """If every tick is late, the torques are bitwise equal to those with motors that receive commands 1 ms
    later."""
    late = run(with_settings(planar, "deadline_ms=1", "solve_ms_per_knot=0.3"), 0.2)
    delayed = run(with_settings(planar, "plant.delay_ms=1"), 0.2)
    assert late["late"].all()
    assert not delayed["late"].any()
    np.testing.assert_array_equal(late["q"], delayed["q"])
    np.testing.assert_array_equal(late["tau_demand"], delayed["tau_demand"])


def test_in_time_is_lockstep(planar: TorqueScene) -> None:
    """If every tick just meets the deadline, the deadline changes nothing."""
    plain, met = run(planar, 0.2), run(with_settings(planar, "deadline_ms=0.5"), 0.2)
    assert not met["late"].any()
    np.testing.assert_array_equal(plain["tau"], met["tau"])


def test_the_horizon_decides_what_is_late(planar: TorqueScene) -> None:
    """When a longer horizon is set during the run, the deadline is missed from that tick on; with the
    previous horizon it is met again."""
    session = TorqueSession(with_settings(planar, "deadline_ms=1"))
    late = []
    for horizon in (10, 11, 10):
        session.post(Set("horizon", horizon))
        late += [bool(value(session, session.tick(), "late")[0]) for _ in range(3)]
    assert late == [False] * 3 + [True] * 3 + [False] * 3


def test_a_reset_forgets_what_waits(planar: TorqueScene) -> None:
    scene = with_settings(planar, "deadline_ms=0.1")
    session = TorqueSession(scene)
    first = session.tick().copy()
    for _ in range(60):
        session.tick()
    session.post(Reset())
    again = session.tick().copy()
    assert value(session, first, "late")[0] == 1.0
    np.testing.assert_array_equal(value(session, again, "tau"), value(session, first, "tau"))
    np.testing.assert_array_equal(value(session, first, "tau"), session_holding(scene))


def session_holding(scene: TorqueScene) -> np.ndarray:
    return TorqueSession(scene).plant.tau


def test_the_clock_decides_only_if_asked_to(planar: TorqueScene) -> None:
    """Without an assumed time, the measured time is used: more than a nanosecond, less than a second."""
    measured = planar.settings.changed("solve_ms_per_knot", 0)
    assert replace(measured, deadline_ms=1e-6).is_late(0.5)
    assert not replace(measured, deadline_ms=1e3).is_late(0.5)
    assert not measured.is_late(0.5)
    assert not replace(planar.settings, deadline_ms=0.5).is_late(1e9)
