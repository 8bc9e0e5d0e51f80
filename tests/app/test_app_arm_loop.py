"""The control loop of a real arm. In these tests an arm in MuJoCo has the interface of the real one."""

from __future__ import annotations

import numpy as np
from arm_bench import Bench, Scripted

from app.arm.drive import Drag
from app.arm.loop import RAMP_SECONDS, Columns
from app.arm.orders import Order, Orders
from lessons.events import MoveTarget
from lessons.recording.run import run as run_scene
from lessons.scenes.run_spec import RunSpec
from robots.arms.arm import Reading


def test_without_gravity_nothing_has_to_be_commanded(bench: Bench) -> None:
    """An arm that compensates its gravity is held by torques near zero, and does not move."""
    ended, rows, at, arm = bench.run()
    assert ended.gently
    assert arm.stopped
    assert np.abs(rows[:, at.q] - bench.scene.q_0).max() < 1e-9
    assert np.abs(rows[:, at.tau]).max() < 1e-6
    assert np.abs(arm.plant.holding_torque()).max() > 10.0, "there is no gravity here"


def test_a_torque_with_gravity_in_it_moves_the_arm(bench: Bench) -> None:
    """If the arm reported the measured torque, which contains gravity, the increments would start from this
    torque and gravity would act twice."""
    gravity = bench.plant().holding_torque()
    _, rows, at, _ = bench.run(shown=lambda reading: reading._replace(tau=reading.tau + gravity))
    assert np.abs(rows[:, at.q] - bench.scene.q_0).max() > 0.05


def test_an_arm_that_compensates_gravity_moves_as_the_lab_does(bench: Bench) -> None:
    """The torques of the arm and of the lab's own run differ by gravity, which only those of the run contain.
    A drag of 7 cm gives the same motion in both."""
    order = bench.order(0.05, 0.0, -0.05)
    spec = RunSpec("panda-hold", events=((0.05, MoveTarget("position", tuple(order.values.tolist()))),))
    spec = spec.but("plant.contacts=false", "plant.joint_stops=false")
    lab = run_scene(spec.prepared(), 0.6)
    ended, rows, at, arm = bench.run(drags={51: order})
    assert ended.gently
    q, wanted = rows[1:600, at.q], lab["q"][:599]
    assert np.abs(wanted[-1] - wanted[0]).max() > 0.05
    assert np.abs(q - wanted).max() < 2e-3
    difference = lab["tau"][598] - rows[599, at.tau]
    arm.plant.reset(q[-1])
    assert np.abs(difference - arm.plant.holding_torque()).max() < 0.5


def test_a_load_that_the_arm_was_not_told_of_is_carried(bench: Bench) -> None:
    """Time-delay estimation compensates the weight of a load that the arm itself does not compensate."""
    _, rows, at, _ = bench.run(plant=bench.plant(payload_kg=1.0), periods=1500)
    assert np.abs(rows[1400:1500, at.error][:, :3]).max() < 2e-3
    assert np.abs(rows[1400:1500, at.tau]).max() > 2.0


def test_no_torque_changes_faster_than_the_arm_accepts(bench: Bench) -> None:
    """The limit holds while the arm is pushed hard and while it is stopped. At the end the torque is
    small."""

    def push(k: int, arm: Scripted) -> None:
        if k in (100, 150):
            arm.plant.push(arm.plant.robot.tip, np.array([400.0, 200.0, 0.0]) * (k == 100))

    ended, rows, at, _ = bench.run(push)
    change = np.abs(np.diff(rows[:, at.tau], axis=0)).max(axis=0)
    assert change.max() > 0.5, "nothing happened"
    assert (change <= 1.0 + 1e-9).all()
    assert ended.gently
    assert np.abs(rows[-1, at.tau]).max() < 0.5
    assert np.abs(rows[-1, at.v]).max() < 0.05
    assert rows[-1, at.t] - rows[rows[:, at.ending] == 0][-1, at.t] >= RAMP_SECONDS


def test_accelerations_are_over_the_time_that_has_passed(bench: Bench) -> None:
    """Four periods are missed while the hand moves, and the torque changes little. A controller that counted
    the five periods as one would compute five times the acceleration; the change of its torque is more than
    five times as large."""

    def miss(k: int, arm: Scripted) -> None:
        if k == 120:
            for _ in range(4):
                arm.inner.read()

    jumps = []
    for happen in (lambda k, arm: None, miss):
        _, rows, at, _ = bench.run(happen, drags={50: bench.order(0.1, 0.0, 0.0)}, periods=200)
        assert rows[:200, at.missed].sum() == (4 if happen is miss else 0)
        jumps.append(np.abs(np.diff(rows[100:140, at.tau], axis=0)).max())
    assert jumps[1] < 2.5 * jumps[0]


def test_the_torque_that_acted_counts(bench: Bench) -> None:
    """The torques of this arm act two periods late, and the arm reports the commanded torque. If the loop
    knows the delay, it controls the arm; if not, the arm continues to shake after a drag."""
    speeds = []
    for delay in (0, 2):
        last = [np.zeros(7)]

        def note(k: int, arm: Scripted, last: list[np.ndarray] = last) -> None:
            last[0] = arm.written

        def commanded(reading: Reading, last: list[np.ndarray] = last) -> Reading:
            return reading._replace(tau=last[0])

        drags = {50: bench.order(0.03, 0.0, 0.03)}
        late = bench.plant(delay_ms=2.0)
        ended, rows, at, _ = bench.run(note, 2500, drags, late, commanded, delay)
        assert ended.why == "the watcher requested it"
        speeds.append(np.abs(rows[2300:2500, at.v]).max())
    assert speeds[1] < 0.03 < 0.1 < speeds[0]


def test_a_drive_holds_drags_and_ends(bench: Bench) -> None:
    """The loop runs in a process of its own; the model beside it makes the same motion."""
    told: list[str] = []
    driven = bench.drive(tell=told.append, duration=0.6, drags=(Drag(0.1, bench.order(0.02, 0.0, 0.02)),))
    assert driven.why == "the 0.6 s are over"
    assert driven.gently
    assert told[0] == "the loop controls the arm"
    at = Columns.of(7, bench.make().view("error").size)
    running = driven.rows[:, at.ending] == 0
    q = driven.rows[running][:, at.q]
    assert np.abs(q[-1] - q[0]).max() > 0.01
    assert np.abs(q - driven.q_model[running]).max() < 0.05


def test_orders_are_whole_or_not_there() -> None:
    """If a task has several orders, the last one counts. An order that is still being written is not read."""
    orders = Orders(3)
    assert orders.news() == []
    orders.drag(Order(2, np.array([1.0, 2.0, 3.0])))
    orders.drag(Order(2, np.array([4.0, 5.0, 6.0])))
    orders.drag(Order(0, np.array([0.0, 1, 2, 3, 4, 5, 6])))
    found = orders.news()
    assert [(each.task, each.values.tolist()) for each in found] == [(0, [*range(7)]), (2, [4.0, 5.0, 6.0])]
    assert orders.taken == 3
    assert orders.news() == []
    orders._head[0] += 1
    orders._counts[1] = 1, 2
    assert orders.news() == []
    orders._head[0] += 1
    assert [each.task for each in orders.news()] == [1]
