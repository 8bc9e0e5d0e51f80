"""The example that drives a Franka arm: its loop, its guard and its door. An arm in MuJoCo has the interface
of the real one."""

from __future__ import annotations

import os
import select
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from examples.franka import franka as door
from examples.franka.drive import check_start, drags_of, drive, image_at, main
from examples.franka.franka import ArmLost
from examples.franka.guard import Guard, Reading, Tolerances
from examples.franka.loop import RAMP_SECONDS, Ended, Loop, Plan, Shared
from examples.franka.simulated import Model, SimulatedArm
from himpc.export.native import NativeController, build
from lessons.events import MoveTarget
from lessons.recording.run import run as run_scene
from lessons.scenes.catalog import as_torque_scene, prepared, torque_scene
from lessons.scenes.run_spec import RunSpec
from robots import InputError, Plant, PlantSettings
from tests.commands.exported import needed

T_S = 1e-3
PATIENT = Tolerances(silent=60.0)  # for a watcher that a busy machine may delay
Happen = Callable[[int, "Scripted"], None]


class Scripted:
    """A simulated arm that calls `happen` at each period; `shown` changes the reading that it reports."""

    def __init__(self, plant: Plant, happen: Happen, wait: float = 0.0) -> None:
        """wait: duration of every read, s. Each read simulates one period, also on a busy machine."""
        self.inner, self.plant, self.happen, self.wait = SimulatedArm(plant, T_S), plant, happen, wait
        self.reads, self.skipped, self.stopped = 0, 0.0, False
        self.shown: Callable[[Reading], Reading] = lambda reading: reading

    def read(self) -> Reading:
        self.happen(self.reads, self)
        self.reads += 1
        time.sleep(self.wait)
        reading = self.inner.read()
        return self.shown(reading._replace(t=reading.t + self.skipped))

    def write(self, tau: np.ndarray) -> None:
        self.inner.write(tau)

    def stop(self) -> None:
        self.stopped = True


def nothing(k: int, arm: Scripted) -> None:
    pass


class Bench:
    """A scene prepared for drives, with its library."""

    def __init__(self, folder: Path) -> None:
        needed("cc")
        self.scene = as_torque_scene(prepared(torque_scene("panda-hold"), None, ()), "it")
        self.image, self.session = image_at(self.scene, self.scene.q_0)
        self.make = partial(NativeController.of, build(folder), self.image)
        self.limits = SimulatedArm(self.plant(), T_S).limits.with_robot(self.scene.robot, self.scene.q_0)

    def plant(self, **changes: Any) -> Plant:
        plant = Plant(self.scene.robot, replace(PlantSettings(), **changes), T_S)
        plant.reset(self.scene.q_0)
        return plant

    def plan(self, duration: float = 0.6, **changes: Any) -> Plan:
        return Plan(self.limits, self.scene.q_0, T_S, duration, **{"tolerances": PATIENT, **changes})

    def drags(self, *moves: Any) -> tuple[Any, ...]:
        return drags_of(moves, self.session, self.image)

    def run(
        self,
        happen: Happen = nothing,
        plant: Plant | None = None,
        shown: Callable[[Reading], Reading] = lambda reading: reading,
        **plan: Any,
    ) -> tuple[Ended, np.ndarray, Scripted]:
        """Runs the loop in this process, one period per read."""
        wanted, controller = self.plan(**plan), self.make()
        shared, arm = Shared(wanted, controller.view("error").size), Scripted(plant or self.plant(), happen)
        arm.shown = shown
        ended = Loop(arm, controller, wanted, shared).run()
        assert arm.stopped
        return ended, shared.rows[: int(shared.count[0])], arm

    def drive(
        self, happen: Happen = nothing, away: float = 0.0, **plan: Any
    ) -> tuple[Ended, np.ndarray, np.ndarray]:
        """Runs the loop beside a process that watches it. away: offset of joint 2 of the model, rad."""
        wanted, beside = self.plan(**plan), self.plant()
        beside.reset(self.scene.q_0 + away * np.eye(7)[1])
        arm = partial(Scripted, self.plant(), happen, T_S)
        ended, shared = drive(wanted, arm, self.make, Model(beside, self.make(), wanted))
        k = int(shared.count[0])
        return ended, shared.rows[:k], shared.q_model[:k]


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("franka"))


# ------------------------------------------------------------------------------------------- the loop


def test_without_gravity_nothing_has_to_be_commanded(bench: Bench) -> None:
    """An arm that compensates its gravity is held by torques near zero, and does not move."""
    ended, rows, arm = bench.run()
    assert ended == Ended("the 0.6 s are over", True, True)
    assert np.abs(rows["q"] - bench.scene.q_0).max() < 1e-9
    assert np.abs(rows["tau"]).max() < 1e-6
    assert np.abs(arm.plant.holding_torque()).max() > 10.0, "there is no gravity here"


def test_a_torque_with_gravity_in_it_moves_the_arm(bench: Bench) -> None:
    """If the arm reported the measured torque, which contains gravity, the increments would start from this
    torque and gravity would act twice."""
    gravity = bench.plant().holding_torque()
    _, rows, _ = bench.run(shown=lambda reading: reading._replace(tau=reading.tau + gravity))
    assert np.abs(rows["q"] - bench.scene.q_0).max() > 0.05


def test_an_arm_that_compensates_gravity_moves_as_the_lab_does(bench: Bench) -> None:
    """The torques of the arm and of the lab's own run differ by gravity, which only those of the run contain.
    A drag of 7 cm gives the same motion in both."""
    (drag,) = drags = bench.drags((0.051, "position", 0.05, 0.0, -0.05))
    spec = RunSpec("panda-hold", events=((0.05, MoveTarget("position", tuple(drag[2].tolist()))),))
    lab = run_scene(spec.but("plant.contacts=false", "plant.joint_stops=false").prepared(), 0.6)
    ended, rows, arm = bench.run(drags=drags)
    assert ended.gently
    q, wanted = rows["q"][1:600], lab["q"][:599]
    assert np.abs(wanted[-1] - wanted[0]).max() > 0.05
    assert np.abs(q - wanted).max() < 2e-3
    arm.plant.reset(q[-1])
    difference = lab["tau"][598] - rows["tau"][599]
    assert np.abs(difference - arm.plant.holding_torque()).max() < 0.5


def test_a_load_that_the_arm_was_not_told_of_is_carried(bench: Bench) -> None:
    """Time-delay estimation compensates the weight of a load that the arm itself does not compensate."""
    _, rows, _ = bench.run(plant=bench.plant(payload_kg=1.0), duration=1.5)
    assert np.abs(rows["error"][1400:1500, :3]).max() < 2e-3
    assert np.abs(rows["tau"][1400:1500]).max() > 2.0


def test_no_torque_changes_faster_than_the_arm_accepts(bench: Bench) -> None:
    """The limit holds while the arm is pushed hard and while it is stopped. At the end the torque is
    small."""

    def push(k: int, arm: Scripted) -> None:
        if k in (100, 150):
            arm.plant.push(arm.plant.robot.tip, np.array([400.0, 200.0, 0.0]) * (k == 100))

    ended, rows, _ = bench.run(push)
    change = np.abs(np.diff(rows["tau"], axis=0)).max(axis=0)
    assert change.max() > 0.5, "nothing happened"
    assert (change <= 1.0 + 1e-9).all()
    assert ended.gently
    assert np.abs(rows["tau"][-1]).max() < 0.5
    assert np.abs(rows["v"][-1]).max() < 0.05
    assert rows["t"][-1] - rows["t"][rows["ending"] == 0][-1] >= RAMP_SECONDS - 1e-9


def test_accelerations_are_over_the_time_that_has_passed(bench: Bench) -> None:
    """Four periods are missed while the hand moves, and the torque changes little. A controller that counted
    the five periods as one would compute five times the acceleration; the change of its torque is more than
    five times as large."""

    def miss(k: int, arm: Scripted) -> None:
        if k == 120:
            for _ in range(4):
                arm.inner.read()

    jumps = []
    for happen in (nothing, miss):
        _, rows, _ = bench.run(happen, drags=bench.drags((0.05, "position", 0.1, 0.0, 0.0)), duration=0.2)
        assert rows["missed"][:200].sum() == (4 if happen is miss else 0)
        jumps.append(np.abs(np.diff(rows["tau"][100:140], axis=0)).max())
    assert jumps[1] < 2.5 * jumps[0]


def test_the_torque_that_acted_counts(bench: Bench) -> None:
    """The torques of this arm act two periods late, and the arm reports the commanded torque. If the loop
    knows the delay, it controls the arm; if not, the arm continues to shake after a drag."""
    speeds = []
    for delay in (0, 2):
        last = [np.zeros(7)]

        def note(k: int, arm: Scripted, last: list[np.ndarray] = last) -> None:
            last[0] = arm.inner._tau

        def commanded(reading: Reading, last: list[np.ndarray] = last) -> Reading:
            return reading._replace(tau=last[0])

        drags = bench.drags((0.05, "position", 0.03, 0.0, 0.03))
        late = bench.plant(delay_ms=2.0)
        ended, rows, _ = bench.run(note, late, commanded, drags=drags, delay=delay, duration=2.5)
        assert ended.wanted
        speeds.append(np.abs(rows["v"][2300:2500]).max())
    assert speeds[1] < 0.03 < 0.1 < speeds[0]


# ------------------------------------------------------------------------------------------- the drive


def test_a_drive_holds_drags_and_ends(bench: Bench) -> None:
    """The model beside the arm makes the same motion, and the watcher has compared nearly all rows."""
    ended, rows, q_model = bench.drive(drags=bench.drags((0.1, "position", 0.02, 0.0, 0.02)))
    assert ended == Ended("the 0.6 s are over", True, True)
    running = (rows["ending"] == 0) & q_model.any(axis=1)
    assert running.sum() > 300
    q = rows["q"][running]
    assert np.abs(q[-1] - q[0]).max() > 0.01
    assert np.abs(q - q_model[running]).max() < 0.05


def test_a_drag_acts_at_its_time_although_the_watcher_is_late(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The loop times the drags by the arm's clock, so that a watcher that gets hardly any processor time
    delays none of them. No row is lost."""
    monkeypatch.setattr("examples.franka.simulated.LOOK", 60.0)
    ended, rows, q_model = bench.drive(drags=bench.drags((0.2, "position", 0.0, 0.0, 0.05)))
    assert ended.wanted and not q_model[-1].any()
    at = rows["t"][np.abs(rows["error"]).max(axis=1) > 1e-6][0]
    assert 0.2 - 1e-9 <= at <= 0.2 + 5 * T_S
    assert np.allclose(np.diff(rows["t"]), T_S)


def test_a_watcher_that_is_behind_stops_the_arm(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The distance from the model is never compared later than after half a second."""
    monkeypatch.setattr(Model, "at", lambda self, t: time.sleep(0.05) or bench.scene.q_0)
    ended, rows, _ = bench.drive(duration=20.0, tolerances=Tolerances())
    assert ended == Ended("the watcher has been silent for 0.5 s", False, True)
    assert rows["t"][rows["ending"] == 0][-1] < 1.0


def test_a_killed_watcher_stops_the_arm(bench: Bench, monkeypatch: pytest.MonkeyPatch) -> None:
    """The loop continues until it has stopped the arm gently."""
    monkeypatch.setattr(Model, "at", lambda self, t: os.kill(os.getpid(), signal.SIGKILL))
    ended, _, _ = bench.drive(duration=20.0, tolerances=Tolerances())
    assert ended == Ended("the watcher has been silent for 0.5 s", False, True)


def test_an_arm_far_from_its_model_is_stopped(bench: Bench) -> None:
    """A drive ends if the model is in another posture than the arm, and the reason names the joint."""
    ended, _, _ = bench.drive(duration=60.0, tolerances=replace(PATIENT, distance=0.05), away=0.1)
    assert ended == Ended("joint 2 is 0.10 rad away from the model", False, True)


def test_an_interrupt_stops_the_arm_gently(bench: Bench) -> None:
    def interrupt(k: int, arm: Scripted) -> None:
        if k == 100:
            os.kill(os.getpid(), signal.SIGINT)

    ended, rows, _ = bench.drive(interrupt, duration=20.0)
    assert ended == Ended("it was interrupted", True, True)
    assert (rows["ending"] == 0).sum() < 110


def test_a_lost_connection_ends_the_loop(bench: Bench) -> None:
    """The reason contains the message of the arm, and the recorded rows are kept."""

    def lose(k: int, arm: Scripted) -> None:
        if k == 300:
            raise ArmLost("UDP receive: Timeout")

    ended, rows, _ = bench.run(lose)
    assert ended == Ended("the arm was lost: UDP receive: Timeout", False, False)
    assert len(rows) == 300


def test_an_arm_that_does_not_answer_ends_the_process(bench: Bench) -> None:
    """No exception can end a call that blocks in the arm's library. The system ends the process, and no more
    torques reach the arm, which stops by itself."""

    def hang(k: int, arm: Scripted) -> None:
        if k == 100:
            time.sleep(1000.0)

    alive, held = os.pipe()
    if (drives := os.fork()) == 0:
        signal.signal(signal.SIGALRM, signal.SIG_DFL)
        bench.drive(hang, duration=20.0, stuck=0.5)
        os._exit(0)
    os.close(held)
    assert os.waitstatus_to_exitcode(os.waitpid(drives, 0)[1]) == -signal.SIGALRM
    # The pipe ends with the last process that holds it: the watcher is not left behind.
    assert select.select([alive], [], [], 60.0)[0] and os.read(alive, 1) == b""
    os.close(alive)


# ------------------------------------------------------------------------------------------- the guard


def test_missed_periods_end_the_loop_gently(bench: Bench) -> None:
    """Eleven missed periods in a row are too many. The arm is then stopped gently, as at every end."""

    def skip(k: int, arm: Scripted) -> None:
        if k == 200:
            arm.skipped += 11 * T_S

    ended, rows, _ = bench.run(skip)
    assert ended == Ended("11 periods were missed one after another", False, True)
    assert rows["missed"].sum() == 11


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
        ({"t": 0.51}, 1, "the watcher has been silent for 0.5 s"),
        ({"away": np.full(7, 0.21)}, 1, "joint 1 is 0.21 rad away from the model"),
    ],
)
def test_the_guard_finds_every_reason_to_end(
    bench: Bench, each: dict[str, Any], periods: int, words: str
) -> None:
    """The guard reports each reason when it has lasted long enough, and not earlier. Without a reason it
    reports nothing."""
    still = {"t": 0.5, "at": 0.0, "away": np.full(7, 0.2)}
    calm = {"reading": reading(), "missed": 0, "hurried": False, "fallback": 0, **still}
    guard, found = Guard(bench.limits, Tolerances(), T_S), None
    for k in range(periods):
        assert found is None, k
        found = guard.check(**{**calm, **each})
        if "last second" in words and found:
            break
    assert found is not None and words in found
    guard = Guard(bench.limits, Tolerances(), T_S)
    assert all(guard.check(**calm) is None for _ in range(2000))


# ------------------------------------------------------------------------------------------- the start


def test_an_arm_that_does_not_fit_the_scene_is_refused(bench: Bench, tmp_path: Path) -> None:
    """A joint outside its range is refused. So is a circle that begins far from the hand, because it would
    pull the arm there at once, and an arm that moved after its pose was read."""
    far = bench.scene.q_0.copy()
    far[3] = 0.0
    with pytest.raises(InputError, match="joint 'joint4' of the arm is at"):
        bench.limits.with_robot(bench.scene.robot, far)
    circle = torque_scene("iiwa14-circle")
    start = circle.q_0 + 0.2
    image, _ = image_at(circle, start)
    with pytest.raises(InputError, match="from where the arm is"):
        check_start(NativeController.of(build(tmp_path), image), start)
    moved = bench.plant()
    moved.reset(bench.scene.q_0 + 0.03)
    ended, _, _ = bench.run(plant=moved)
    assert ended == Ended("the arm has moved by 0.030 rad after its pose was read", False, True)
    with pytest.raises(InputError, match="There is no task with a position target 'posture'"):
        bench.drags((1.0, "posture", 0.0, 0.0, 0.0))
    with pytest.raises(InputError, match="--duration must be above 0"):
        main("panda-hold", "simulated", duration=0.0)


class FakeLibrary:
    """Replaces pylibfranka. It has the names that the door uses, and one arm with given answers."""

    class FrankaException(Exception):
        pass

    class RealtimeConfig:
        kEnforce, kIgnore = "enforce", "ignore"

    class Torques:
        def __init__(self, tau_J: list[float]) -> None:
            self.tau_J, self.motion_finished = tau_J, False

    def __init__(self) -> None:
        self.sent: list[FakeLibrary.Torques] = []
        self.fails = False
        self.q, self.end, self.hand = [0.1] * 7, np.eye(4), np.eye(4)

    def Robot(self, address: str, config: str) -> FakeLibrary:
        if address == "nowhere":
            raise RuntimeError("libfranka: Connection error: Host not found.")
        return self

    def read_once(self) -> Any:
        return self.readOnce()[0]

    def start_torque_control(self) -> FakeLibrary:
        return self

    def readOnce(self) -> tuple[Any, None]:
        if self.fails:
            raise RuntimeError("libfranka: UDP receive: Timeout")
        clock = type("Clock", (), {"to_sec": lambda self: 2.5})()
        state: dict[str, Any] = {"dq": [0.2] * 7, "tau_J": [30.0] * 7, "tau_J_d": [0.5] * 7, "time": clock}
        state |= {"q": self.q, "O_T_EE": self.end.T.ravel().tolist(), "F_T_EE": self.hand.T.ravel().tolist()}
        return type("State", (), state)(), None

    def writeOnce(self, torques: FakeLibrary.Torques) -> None:
        if self.fails:
            raise self.FrankaException("libfranka: UDP send failed")
        self.sent.append(torques)


@pytest.fixture
def library(monkeypatch: pytest.MonkeyPatch) -> FakeLibrary:
    made = FakeLibrary()
    monkeypatch.setattr(door, "import_module", lambda name: made)
    return made


def test_the_door_reads_the_torque_without_gravity(library: FakeLibrary) -> None:
    """The torque is `tau_J_d`, not the measured `tau_J`. The last torque is zero and marked as the last."""
    arm = door.Franka("arm")
    found = arm.read()
    assert (found.q[0], found.v[0], found.tau[0], found.t) == (0.1, 0.2, 0.5, 2.5)
    arm.write(np.array([0.0, 1, 2, 3, 4, 5, 6]))
    arm.stop()
    arm.stop()
    assert [each.tau_J for each in library.sent] == [[*range(7)], [0.0] * 7]
    assert [each.motion_finished for each in library.sent] == [False, True]


def test_the_door_tells_what_the_library_tells(library: FakeLibrary) -> None:
    with pytest.raises(InputError, match="nowhere: Connection error: Host not found"):
        door.Franka("nowhere")
    arm = door.Franka("arm")
    arm.read()
    library.fails = True
    with pytest.raises(ArmLost, match="UDP send failed"):
        arm.write(np.zeros(7))
    with pytest.raises(ArmLost, match="UDP receive: Timeout"):
        arm.read()
    arm.stop()
    assert library.sent == []


def test_the_arm_must_be_the_scene_s_robot(library: FakeLibrary, bench: Bench) -> None:
    """The flange that the arm reports must be on the last axis of the described robot. Another arm of seven
    joints is refused, and so is a robot with another number of joints."""
    robot = bench.scene.robot
    library.q = robot.home.tolist()
    rotation, position = bench.plant().frame_pose("flange" if "flange" in robot.frames else "link8")
    library.hand[:3, 3] = 0.0, 0.02, 0.1
    library.end[:3, :3], library.end[:3, 3] = rotation, position + rotation @ library.hand[:3, 3]
    assert np.array_equal(door.Franka("arm").at_rest(robot), robot.home)
    for name in ("iiwa14", "planar3"):
        with pytest.raises(InputError, match=f"'{name}' is not this arm"):
            door.Franka("arm").at_rest(torque_scene(f"{name}-hold").robot)


def test_nobody_answers_at_this_machine() -> None:
    """No arm listens at this address, and the error contains the message of the real library."""
    pytest.importorskip("pylibfranka")
    with pytest.raises(InputError, match=r"127\.0\.0\.1: "):
        door.Franka("127.0.0.1")


def test_the_example_has_one_door() -> None:
    """Only the door imports pylibfranka."""
    texts = {path.name: path.read_text() for path in Path(door.__file__).parent.glob("*.py")}
    assert {name for name, text in texts.items() if '"pylibfranka"' in text} == {"franka.py"}
