"""A real arm's loop, with an arm in MuJoCo behind the interface of a real one."""

from __future__ import annotations

import multiprocessing
import os
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.__main__ import main
from app.arm.drive import Drag, Drive, Driven, drive
from app.arm.guard import ArmGuard, Tolerances
from app.arm.loop import RAMP_SECONDS, Columns, Ended, run
from app.arm.model import Model
from app.arm.orders import Order, Orders
from app.arm.prepared import Prepared, check_start, maker, prepared
from app.link.process import wait_until
from app.link.ring import Block
from himpc.export.native import build
from lessons.events import MoveTarget
from lessons.recording.run import run as run_scene
from lessons.scenes.catalog import load_scene, torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.torque_scene import TorqueScene
from robots import InputError, Plant, PlantSettings
from robots import franka as door
from robots.arm import Arm, ArmLost, Reading
from robots.simulated_arm import SimulatedArm
from tests.commands.exported import needed

T_S = 1e-3
PATIENT = Tolerances(silent=60.0)
"""For a watcher that a busy machine may hold up."""
ALONE = Tolerances()


class Scripted(Arm):
    """A simulated arm that does something at a period; `shown` changes what it says."""

    def __init__(self, plant: Plant, happen: Callable[[int, Scripted], None], wait: float = 0.0) -> None:
        """wait: s that every read takes; a period passes with each, however busy the machine is."""
        self.inner, self.wait = SimulatedArm(plant, T_S, in_step=False), wait
        self.limits, self.plant = self.inner.limits, plant
        self.happen, self.reads, self.skipped = happen, 0, 0.0
        self.written = np.zeros(plant.n)
        self.shown: Callable[[Reading], Reading] = lambda reading: reading
        self.stopped = False

    def read(self) -> Reading:
        self.happen(self.reads, self)
        self.reads += 1
        time.sleep(self.wait)
        reading = self.inner.read()
        return self.shown(reading._replace(t=reading.t + self.skipped))

    def write(self, tau: np.ndarray) -> None:
        self.inner.write(tau)
        self.written = tau

    def stop(self) -> None:
        self.stopped = True
        self.inner.stop()


class Bench:
    """A scene prepared for drives, with its library."""

    def __init__(self, folder: Path) -> None:
        needed("cc")
        self.scene = torque_scene("panda-hold")
        self.settings = PlantSettings()  # without contacts: faster
        self.ready = self.prepared(self.scene)
        self.make = maker(build(folder), self.ready.image)

    def prepared(self, scene: TorqueScene) -> Prepared:
        arm = SimulatedArm(self.plant())
        return prepared(scene, scene.q_0, arm.limits, ())

    def plant(self, **changes: Any) -> Plant:
        plant = Plant(self.scene.robot, replace(self.settings, **changes), T_S)
        plant.reset(self.scene.q_0)
        return plant

    def run(
        self,
        happen: Callable[[int, Scripted], None] = lambda k, arm: None,
        periods: int = 600,
        drags: dict[int, Order] | None = None,
        plant: Plant | None = None,
        shown: Callable[[Reading], Reading] | None = None,
        delay: int = 0,
    ) -> tuple[Ended, np.ndarray, Columns, Scripted]:
        """The loop in this process, one period per read; `drags` by their period; asked to end after so many
        periods."""
        controller = self.make()
        orders, at = Orders(4), Columns.of(7, controller.view("error").size)
        block = Block(at.width, 8)

        def each(k: int, arm: Scripted) -> None:
            orders.beat()
            if drags and k in drags:
                orders.drag(drags[k])
            if k == periods:
                orders.stop()
            happen(k, arm)

        arm = Scripted(plant or self.plant(), each)
        arm.shown = shown or arm.shown
        ended = run(
            arm, controller, self.ready.limits, self.scene.q_0, orders, block, Tolerances(), T_S, delay
        )
        _, rows = block.since(0)
        assert len(rows) == ended.rows
        return ended, rows, at, arm

    def drive(
        self,
        happen: Callable[[int, Scripted], None] = lambda k, arm: None,
        tell: Callable[[str], None] = lambda text: None,
        duration: float = 0.3,
        drags: tuple[Drag, ...] = (),
        tolerances: Tolerances = PATIENT,
        elsewhere: float = 0.0,
    ) -> Driven:
        """A drive with the loop in a process of its own; elsewhere: rad, how far joint 2 of the model is
        off."""
        beside = self.plant()
        beside.reset(self.scene.q_0 + elsewhere * np.eye(7)[1])
        wanted = Drive(
            lambda: Scripted(self.plant(), happen, T_S),
            self.make,
            self.ready.limits,
            self.scene.q_0,
            T_S,
            duration,
            drags,
            tolerances,
        )
        return drive(wanted, Model(beside, self.make(), self.ready.limits, T_S), tell)

    def order(self, *moved: float) -> Order:
        """The hand's target moves, m."""
        (task,) = (each for each in self.ready.image.manifest["tasks"] if each["name"] == "position")
        _, position = self.plant().frame_pose(self.scene.robot.tip)
        return Order(task["index"], position + np.array(moved))


@pytest.fixture(scope="module")
def bench(tmp_path_factory: pytest.TempPathFactory) -> Bench:
    return Bench(tmp_path_factory.mktemp("arm"))


def test_without_gravity_nothing_has_to_be_commanded(bench: Bench) -> None:
    """An arm that compensates its gravity is held by torques near zero, and moves by nothing."""
    ended, rows, at, arm = bench.run()
    assert ended.gently
    assert arm.stopped
    assert np.abs(rows[:, at.q] - bench.scene.q_0).max() < 1e-9
    assert np.abs(rows[:, at.tau]).max() < 1e-6
    assert np.abs(arm.plant.holding_torque()).max() > 10.0, "there is no gravity here"


def test_a_torque_with_gravity_in_it_moves_the_arm(bench: Bench) -> None:
    """If the arm reported the measured torque, in which gravity is contained, increments would start from
    there and gravity would act twice."""
    gravity = bench.plant().holding_torque()
    _, rows, at, _ = bench.run(shown=lambda reading: reading._replace(tau=reading.tau + gravity))
    assert np.abs(rows[:, at.q] - bench.scene.q_0).max() > 0.05


def test_an_arm_that_compensates_gravity_moves_as_the_lab_does(bench: Bench) -> None:
    """The torques differ by gravity, and the motion does not: a drag of 7 cm comes out as in the lab's own
    run, whose torques contain gravity."""
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
    """Time-delay estimation finds the weight that the arm does not compensate."""
    _, rows, at, _ = bench.run(plant=bench.plant(payload_kg=1.0), periods=1500)
    assert np.abs(rows[1400:1500, at.error][:, :3]).max() < 2e-3
    assert np.abs(rows[1400:1500, at.tau]).max() > 2.0


def test_no_torque_changes_faster_than_the_arm_accepts(bench: Bench) -> None:
    """Not while it is pushed hard, and not while it is stopped; at the end nothing is commanded."""

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


def test_missed_periods_end_the_loop_gently(bench: Bench) -> None:
    """Eleven periods in a row are too many; the torque is then taken away as at every end."""

    def skip(k: int, arm: Scripted) -> None:
        if k == 200:
            arm.skipped += 11 * T_S

    ended, rows, at, arm = bench.run(skip)
    assert ended.why == "11 periods were missed one after another"
    assert ended.gently
    assert arm.stopped
    assert rows[:, at.missed].sum() == 11


def test_accelerations_are_over_the_time_that_has_passed(bench: Bench) -> None:
    """While the hand moves, four periods are missed, and the torque jumps by little. A controller that took
    the five periods for one would see five times the acceleration; its torque jumps by more than five times
    as much."""

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
    """An arm whose torques act two periods late, and that tells what was commanded, is controlled if the
    delay is known; else it goes on shaking after a drag."""
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
        assert ended.why == "the watcher asked for it"
        speeds.append(np.abs(rows[2300:2500, at.v]).max())
    assert speeds[1] < 0.03 < 0.1 < speeds[0]


def test_a_lost_connection_ends_the_loop(bench: Bench) -> None:
    """What the arm told is passed on, and what was recorded stays."""

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
        ({"hurried": True}, 26, "change too fast in 26 periods"),
        ({"fallback": 6}, 11, "no torque in 11 periods"),
        ({"reading": reading(v=2.4)}, 1, "joint 1 moves with 2.40 rad/s"),
        ({"reading": reading(q=float("nan"))}, 1, "not finite"),
        ({"beats": 7}, 502, "the watcher has been silent for 0.5 s"),
    ],
)
def test_the_guard_finds_every_reason_to_end(
    bench: Bench, each: dict[str, Any], periods: int, words: str
) -> None:
    """Each reason is found when it has lasted long enough and no earlier than it may be; without it nothing
    is found."""
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


def test_a_drive_holds_drags_and_ends(bench: Bench) -> None:
    """The loop runs in a process of its own; the model beside it makes the same motion."""
    told: list[str] = []
    driven = bench.drive(tell=told.append, duration=0.6, drags=(Drag(0.1, bench.order(0.02, 0.0, 0.02)),))
    assert driven.why == "the 0.6 s are over"
    assert driven.gently
    assert told[0] == "the loop has taken over"
    at = Columns.of(7, bench.make().view("error").size)
    running = driven.rows[:, at.ending] == 0
    q = driven.rows[running][:, at.q]
    assert np.abs(q[-1] - q[0]).max() > 0.01
    assert np.abs(q - driven.q_model[running]).max() < 0.05


def test_an_arm_far_from_its_model_is_stopped(bench: Bench) -> None:
    """A model that stands elsewhere ends the drive, and the reason names the joint."""
    driven = bench.drive(duration=60.0, tolerances=replace(PATIENT, distance=0.05), elsewhere=0.1)
    assert driven.why == "joint 2 is 0.10 rad away from the model"
    assert driven.gently
    assert not driven.wanted


def test_a_killed_loop_is_told_and_its_rows_stay(bench: Bench) -> None:
    """Whoever watches hears of it at once."""

    def die(k: int, arm: Scripted) -> None:
        if k == 100:
            os.kill(os.getpid(), signal.SIGKILL)

    driven = bench.drive(die, duration=20.0)
    assert driven.why == "the process of the loop ended (exit code -9)"
    assert not driven.gently
    assert len(driven.rows) == 100


def test_a_library_that_hangs_ends_the_loop_s_process(bench: Bench) -> None:
    """No process stays behind that waits for an answer of the arm for ever."""

    def hang(k: int, arm: Scripted) -> None:
        if k == 20:
            time.sleep(1000.0)

    wanted = Drive(
        lambda: Scripted(bench.plant(), hang, T_S),
        bench.make,
        bench.ready.limits,
        bench.scene.q_0,
        T_S,
        60.0,
        tolerances=PATIENT,
        stuck=0.5,
    )
    driven = drive(wanted, Model(bench.plant(), bench.make(), bench.ready.limits, T_S), lambda text: None)
    assert driven.why == f"the process of the loop ended (exit code {-signal.SIGALRM})"
    assert len(driven.rows) == 20


def test_a_watcher_that_hangs_delays_nothing(bench: Bench) -> None:
    """The loop notices its silence and stops the arm gently meanwhile."""
    over = multiprocessing.get_context("fork").Event()

    def hang(text: str) -> None:
        assert over.wait(60.0)

    class Ending(Scripted):
        def stop(self) -> None:
            super().stop()
            over.set()

    wanted = Drive(
        lambda: Ending(bench.plant(), lambda k, arm: None, T_S),
        bench.make,
        bench.ready.limits,
        bench.scene.q_0,
        T_S,
        60.0,
        (),
        ALONE,
    )
    driven = drive(wanted, Model(bench.plant(), bench.make(), bench.ready.limits, T_S), hang)
    assert "the watcher has been silent" in driven.why
    assert driven.gently


def test_a_killed_watcher_leaves_no_moving_arm(bench: Bench, tmp_path: Path) -> None:
    """The loop outlives whoever watched it for as long as it takes to stop the arm gently."""
    begun, over = tmp_path / "begun", tmp_path / "over"

    class Noting(Scripted):
        def stop(self) -> None:
            super().stop()
            over.write_text(str(os.getpid()))

    def note(k: int, arm: Scripted) -> None:
        if k == 5:
            begun.touch()

    def watch() -> None:
        bench_drive = Drive(
            lambda: Noting(bench.plant(), note, T_S),
            bench.make,
            bench.ready.limits,
            bench.scene.q_0,
            T_S,
            60.0,
            (),
            ALONE,
        )
        drive(bench_drive, Model(bench.plant(), bench.make(), bench.ready.limits, T_S), lambda text: None)

    watcher = multiprocessing.get_context("fork").Process(target=watch)
    watcher.start()
    assert wait_until(begun.exists, 60.0)
    watcher.kill()
    watcher.join()
    assert wait_until(over.exists, 60.0)


def test_orders_are_whole_or_not_there() -> None:
    """The last place of each task counts; an order that is being written is not seen."""
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


def test_the_command_drives_and_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`himpc-lab arm` with a simulated arm prints what happens, and writes a row per period."""
    needed("cc")
    path = tmp_path / "run.npz"
    words = "arm panda-hold --robot simulated --duration 1.2 --drag 0.2:position=0.02,0,0 --missed 10000"
    main([*words.split(), "--npz", str(path), "--plot", str(tmp_path)])
    assert (tmp_path / "arm.png").read_bytes()[:4] == b"\x89PNG"
    told = capsys.readouterr().out
    assert "the loop has taken over" in told
    assert "ended: " in told
    with np.load(path) as data:
        rows = len(data["t"])
        assert rows > 0
        assert data["q"].shape == data["q_model"].shape == data["tau"].shape == (rows, 7)
        assert data["error/position"].shape == (rows, 3)
        assert "0.2:position" in str(data["settings"])


@pytest.mark.parametrize(
    ("more", "words"),
    [
        (["panda-hold", "--robot", "simulated", "--duration", "0"], "--duration is 0.0 s"),
        (["panda-hold", "--robot", "simulated", "--distance", "nan"], "--distance is nan"),
        (["iiwa14-htmpc", "--robot", "simulated"], "driven by velocities"),
        (["panda-hold", "--robot", "simulated", "--drag", "1:hand=0,0,0"], "task with a target"),
        (["panda-hold", "--robot", "simulated", "--drag", "soon"], "cannot be read"),
        (["panda-hold", "--robot", "simulated", "--drag", "1:posture=0,0,0"], "takes 7"),
        (["panda-hold", "--robot", "simulated", "--controller", "osf"], "OSF is not compiled"),
    ],
)
def test_what_cannot_be_driven_is_told_in_one_sentence(
    more: list[str], words: str, capsys: pytest.CaptureFixture[str]
) -> None:
    assert main(["arm", *more]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert len(told.splitlines()) == 1


def test_an_arm_that_does_not_fit_the_scene_is_refused(bench: Bench) -> None:
    """Another number of joints, a joint outside its range, a motion that begins elsewhere."""
    limits = SimulatedArm(bench.plant()).limits
    with pytest.raises(InputError, match="has 7 joints and the scene's robot 'planar3' has 3"):
        limits.with_robot(torque_scene("planar3-hold").robot)
    far = bench.scene.q_0.copy()
    far[3] = 0.0
    with pytest.raises(InputError, match="joint 'joint4' of the arm is at"):
        prepared(bench.scene, far, limits, ())


def test_a_motion_that_begins_elsewhere_is_refused(bench: Bench, tmp_path: Path) -> None:
    """A circle that begins far from the hand would pull the arm there at once."""
    scene = load_scene("iiwa14-circle")
    assert isinstance(scene, TorqueScene)
    arm = SimulatedArm(Plant(scene.robot))
    start = scene.q_0 + 0.2
    ready = prepared(scene, start, arm.limits, ())
    with pytest.raises(InputError, match="from where the arm is"):
        check_start(maker(build(tmp_path), ready.image)(), start)


class FakeLibrary:
    """pylibfranka's names that the door uses, with one arm that answers as told."""

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
        self.config = config
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
    monkeypatch.setattr(door, "_library", lambda: made)
    return made


def test_the_door_reads_the_torque_without_gravity(library: FakeLibrary) -> None:
    """`tau_J_d`, not the measured `tau_J`; the last torque is zero and says that it is the last."""
    arm = door.Franka("arm")
    assert library.config == "ignore"
    found = arm.read()
    assert (found.q[0], found.v[0], found.tau[0], found.t) == (0.1, 0.2, 0.5, 2.5)
    arm.write(np.array([0.0, 1, 2, 3, 4, 5, 6]))
    arm.stop()
    arm.stop()
    assert [each.tau_J for each in library.sent] == [[*range(7)], [0.0] * 7]
    assert [each.motion_finished for each in library.sent] == [False, True]


def test_the_door_tells_what_the_library_tells(library: FakeLibrary) -> None:
    with pytest.raises(InputError, match="--robot nowhere: Connection error: Host not found; is this"):
        door.Franka("nowhere")
    arm = door.Franka("arm", real_time=True)
    assert library.config == "enforce"
    arm.read()
    library.fails = True
    with pytest.raises(ArmLost, match="UDP send failed"):
        arm.write(np.zeros(7))
    with pytest.raises(ArmLost, match="UDP receive: Timeout"):
        arm.read()
    arm.stop()
    assert library.sent == []


def test_the_arm_must_be_the_scene_s_robot(library: FakeLibrary, bench: Bench) -> None:
    """The flange that the arm tells must be on the last axis of the description; another arm of seven joints
    is refused."""
    robot = bench.scene.robot
    library.q = robot.home.tolist()
    rotation, position = bench.plant().frame_pose("flange" if "flange" in robot.frames else "link8")
    library.hand[:3, 3] = 0.0, 0.02, 0.1
    library.end[:3, :3], library.end[:3, 3] = rotation, position + rotation @ library.hand[:3, 3]
    assert np.array_equal(door.Franka("arm").at_rest(robot), robot.home)
    with pytest.raises(InputError, match="'iiwa14' is not this arm"):
        door.Franka("arm").at_rest(torque_scene("iiwa14-hold").robot)


def test_nobody_answers_at_this_machine() -> None:
    """The real library says so in a sentence. No arm listens here."""
    pytest.importorskip("pylibfranka")
    with pytest.raises(InputError, match="is this the address of the arm"):
        door.Franka("127.0.0.1")
