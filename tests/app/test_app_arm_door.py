"""The command that drives an arm, and the one module that communicates with a Franka arm."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from arm_bench import Bench

from app.__main__ import main
from app.arm.prepared import check_start, maker, prepared
from himpc.export.native import build
from lessons.scenes.catalog import load_scene, torque_scene
from lessons.scenes.torque_scene import TorqueScene
from robots import InputError, Plant
from robots.arms import franka as door
from robots.arms.arm import ArmLost
from robots.arms.simulated_arm import SimulatedArm
from tests.commands.exported import needed


def test_the_command_drives_and_records(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """`himpc-lab arm` with a simulated arm prints what happens, and writes a row per period."""
    needed("cc")
    path = tmp_path / "run.npz"
    words = "arm panda-hold --robot simulated --duration 1.2 --drag 0.2:position=0.02,0,0 --missed 10000"
    main([*words.split(), "--npz", str(path), "--plot", str(tmp_path)])
    assert (tmp_path / "arm.png").read_bytes()[:4] == b"\x89PNG"
    told = capsys.readouterr().out
    assert "the loop controls the arm" in told
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
        (["panda-hold", "--robot", "simulated", "--missed-share", "2"], "--missed-share is 2.0"),
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
    """A scene whose robot has another number of joints is refused, and so is an arm with a joint outside its
    range."""
    limits = SimulatedArm(bench.plant()).limits
    with pytest.raises(InputError, match="has 7 joints and the scene's robot 'planar3' has 3"):
        limits.with_robot(torque_scene("planar3-hold").robot)
    far = bench.scene.q_0.copy()
    far[3] = 0.0
    with pytest.raises(InputError, match="joint 'joint4' of the arm is at"):
        prepared(bench.scene, far, limits, ())


def test_a_motion_that_begins_elsewhere_is_refused(bench: Bench, tmp_path: Path) -> None:
    """A circle that begins far from the hand is refused, because it would pull the arm there at once."""
    scene = load_scene("iiwa14-circle")
    assert isinstance(scene, TorqueScene)
    arm = SimulatedArm(Plant(scene.robot))
    start = scene.q_0 + 0.2
    ready = prepared(scene, start, arm.limits, ())
    with pytest.raises(InputError, match="from where the arm is"):
        check_start(maker(build(tmp_path), ready.image)(), start)


class FakeLibrary:
    """Replaces pylibfranka. It has the names that `robots.arms.franka` uses, and one arm with given
    answers."""

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
    """The torque is `tau_J_d`, not the measured `tau_J`. The last torque is zero and marked as the last."""
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
    with pytest.raises(
        InputError, match="--robot nowhere: Connection error: Host not found; check the address of the arm"
    ):
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
    """The flange that the arm reports must be on the last axis of the described robot. Another arm of seven
    joints is refused."""
    robot = bench.scene.robot
    library.q = robot.home.tolist()
    rotation, position = bench.plant().frame_pose("flange" if "flange" in robot.frames else "link8")
    library.hand[:3, 3] = 0.0, 0.02, 0.1
    library.end[:3, :3], library.end[:3, 3] = rotation, position + rotation @ library.hand[:3, 3]
    assert np.array_equal(door.Franka("arm").at_rest(robot), robot.home)
    with pytest.raises(InputError, match="'iiwa14' is not this arm"):
        door.Franka("arm").at_rest(torque_scene("iiwa14-hold").robot)


def test_nobody_answers_at_this_machine() -> None:
    """No arm listens at this address, and the error contains the message of the real library."""
    pytest.importorskip("pylibfranka")
    with pytest.raises(InputError, match="check the address of the arm"):
        door.Franka("127.0.0.1")
