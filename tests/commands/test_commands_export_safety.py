"""An exported controller refuses damaged numbers and those of another controller, and no setting can give it
limits that are far beyond those of its robot."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from himpc.export.image import MULTIPLE
from himpc.export.native import NativeController
from lessons.settings.schema import settings_of
from lessons.settings.torque import TorqueSettings
from robots import load_robot
from tests.commands.exported import controller_in, exported, needed, replayed

pytestmark = pytest.mark.nightly(
    *("himpc/", "app/commands/export.py", "app/__main__.py", "robots/settings.py"),
    *(f"lessons/{part}" for part in ("events", "recording", "runs", "scenes", "session", "settings")),
)
"""Compiling a controller for export takes a minute of a core."""
LIMITS, WEIGHTS, BUDGET = 5, 8, 9
FEW = ("--ticks", "30")


@pytest.fixture(scope="module")
def folders(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Path]:
    """Returns the exported controller of an arm with 7 joints."""
    needed("cc")
    return {"iiwa14-hold": exported("iiwa14-hold", "x86_64-linux", tmp_path_factory.mktemp("export"), *FEW)}


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


STATE = """
    double q[HIMPC_N] = {0}, v[HIMPC_N] = {0}, tau[HIMPC_N];
"""
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
        + STATE
        + """
    double lots[HIMPC_N], low[HIMPC_N], high[HIMPC_N];
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


def test_two_controllers_are_used_in_one_file_with_two_prefixes(tmp_path: Path) -> None:
    """Names, header and object file have the prefix. Two headers with one prefix are an error of the
    compiler, since the second one would vanish."""
    needed("cc")
    for prefix, scene in (("himpc", "iiwa14-hold"), ("right", "planar3-hold")):
        folder = exported(scene, "x86_64-linux", tmp_path / prefix, *FEW, "--prefix", prefix)
        assert f"{prefix}.h" in (folder / "README.md").read_text()
        shutil.copy(folder / f"{prefix}.h", tmp_path)
        shutil.copy(folder / f"{prefix}.o", tmp_path)
    assert replayed(tmp_path / "right")[1] < 1e-9
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
