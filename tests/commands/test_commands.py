"""The command line: exit codes, one clear sentence per error, and the documented JSON keys."""

from __future__ import annotations

import json
import re
import shlex
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from app.__main__ import COMMANDS, main
from lessons.course import COURSE
from lessons.experiments.jobs import TIMING_KEYS
from lessons.replay.state import State, encode
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.check import Verdict
from robots import CATALOG

ROOT = Path(__file__).parents[2]
NO_ROBOT = str(ROOT / "robots" / "meshes")


WRONG: dict[str, tuple[list[str], str]] = {
    "no such command": (["rnu"], "run"),
    "no such scene": (["run", "iiwa14-hodl"], "iiwa14-hold"),
    "hold without a robot": (["run", "hold"], "--urdf"),
    "missing file": (["run", "hold", "--urdf", "/nowhere/arm.urdf"], "/nowhere/arm.urdf"),
    "a folder without a robot": (["run", "hold", "--urdf", NO_ROBOT], "has no robot description"),
    "the other name of the option": (["run", "hold", "--robot", "/nowhere/arm.xml"], "/nowhere/arm.xml"),
    "no such catalog robot": (["run", "hold", "--urdf", "iiwa15"], "iiwa14"),
    "unknown frame": (["run", "hold", "--urdf", "planar3", "--tip", "nose"], "nose"),
    "unknown joint to hold": (["run", "hold", "--urdf", "planar3", "--hold", "nose"], "joint_1"),
    "held joints of a fixed scene": (["--scene", "planar3-hold", "--hold", "joint_1"], "hold"),
    "a robot for a fixed scene": (["run", "iiwa14-hold", "--urdf", "planar3"], "hold"),
    "unknown controller": (["run", "iiwa14-hold", "--controller", "himcp"], "himpc"),
    "N = 0": (["run", "iiwa14-hold", "--set", "horizon=0"], "horizon"),
    "M̄ too short": (["run", "iiwa14-hold", "--set", "M_bar=[1,1]"], "M_bar"),
    "NaN": (["run", "iiwa14-hold", "--set", "Q=NaN"], "finite"),
    "a typo": (["run", "iiwa14-hold", "--set", "plant.paylod_kg=2"], "plant.payload_kg"),
    "no value": (["run", "iiwa14-hold", "--set", "horizon"], "PATH=VALUE"),
    "wrong length": (["run", "iiwa14-hold", "--set", "levels.1.Q=[1,2]"], "3"),
    "wrong plant length": (["run", "iiwa14-hold", "--set", "plant.friction=[1,2]"], "friction"),
    "duration 0": (["run", "iiwa14-hold", "--duration", "0"], "duration"),
    "duration nan": (["run", "iiwa14-hold", "--duration", "nan"], "duration"),
    "no scene and no state": (["run"], "--state"),
    "a scene and a state": (["run", "planar3-hold", "--state", "hl1-x"], "leave out"),
    "a bad code": (["run", "--state", "hl1-x"], "copy all of it"),
    "a bad code for the page": (["--state", "hl1-x"], "copy all of it"),
    "a scene and a state for the page": (["--scene", "planar3-hold", "--state", "hl1-x"], "leave out"),
    "a negative deadline": (["run", "planar3-hold", "--set", "deadline_ms=-1"], "deadline_ms"),
    **{
        words: (["run", "ridgeback-ur10-square", "--duration", "0.1", *words.split()], says)
        for words, says in (
            ("--controller himpc", "choose one of htmpc"),
            ("--controller htmcp", "'htmpc'"),
            ("--set peak=[1]", "give x and y"),
            ("--set delta=0.1", "'delta_m'"),
            ("--set input_effort=[1,2]", "9 joints"),
            ("--urdf panda", "brings its own robot"),
        )
    },
    "json nowhere": (["run", "planar3-hold", "--duration", "0.01", "--json", "/nowhere/x.json"], "--json"),
    "npz nowhere": (["run", "planar3-hold", "--duration", "0.01", "--npz", "/nowhere/x.npz"], "--npz"),
    "check a lesson": (["lessons", "--check", "one-tsak"], "one-task"),
    "check a missing file": (["robots", "--check", "/nowhere/arm.urdf"], "/nowhere/arm.urdf"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_gets_one_sentence_and_exit_2(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    """One line on stderr names the fault or the remedy, without a traceback; stdout is empty."""
    arguments, says = WRONG[case]
    assert main(arguments) == 2
    out, err = capfd.readouterr()
    assert len(err.strip().splitlines()) == 1
    assert err.startswith("himpc-lab: ")
    assert says in err
    assert "Traceback" not in err
    assert out.strip() == ""


def test_a_broken_urdf_gets_one_sentence(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "broken.urdf"
    path.write_text('<robot name="arm"><link name="base"></robot>')
    assert main(["run", "hold", "--urdf", str(path)]) == 2
    err = capfd.readouterr().err
    assert len(err.strip().splitlines()) == 1
    assert "broken.urdf" in err


def test_unknown_options_are_usage_errors(capfd: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as stop:
        main(["run", "iiwa14-hold", "--frobnicate"])
    assert stop.value.code == 2
    assert "Traceback" not in capfd.readouterr().err


KEYS = {
    "scene": str,
    "controller": str,
    "seed": int,
    "duration_s": float,
    "diverged": bool,
    "diverged_at_s": type(None),
    "finite": bool,
    "tasks": list,
    "average_cost": list,
    "limits": dict,
    "solver": dict,
    "priority_leak_max": float,
    "dynamic_leak_max": float,
    "bound_active_share": float,
    "contact": dict,
    "step_ms": dict,
    "real_time_factor": float,
}


def test_run_prints_the_contract(capfd: pytest.CaptureFixture[str]) -> None:
    """`run --json -` prints one JSON object with the documented keys and nothing else."""
    given = ["--duration", "0.05", "--seed", "7", "--set", "horizon=3", "--json", "-"]
    assert main(["run", "iiwa14-hold", *given]) == 0
    result: dict[str, Any] = json.loads(capfd.readouterr().out)
    for key, kind in KEYS.items():
        assert isinstance(result[key], kind), key
    assert (result["scene"], result["controller"], result["seed"]) == ("iiwa14-hold", "himpc", 7)
    assert result["duration_s"] == pytest.approx(0.05)
    for task in result["tasks"]:
        assert set(task) == {"name", "level", "coordinates", "unit", "rmse", "rmse_after_1s", "max_abs"}
        assert len(task["rmse"]) == len(task["max_abs"]) == len(task["coordinates"])
        assert task["unit"] in ("m", "deg")
    assert len(result["average_cost"]) == 3
    assert set(result["limits"]) == {"torque", "velocity", "position", "acceleration", "jerk"}
    assert set(result["limits"]["torque"]) == {"max_ratio", "applied_max_ratio"}
    solver = result["solver"]
    assert set(solver) == {
        *("backend", "route", "solves", "unsolved", "fallbacks", "max_kkt_residual", "iterations")
    }
    assert (solver["backend"], solver["route"], solver["solves"]) == ("goldfarb-idnani", "compiled", 150)
    assert set(result["step_ms"]) == {"median", "p99", "max"}
    assert result["contact"] == {"max_depth_m": 0.0, "max_force_N": 0.0, "time_s": 0.0}


def test_run_writes_files(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """--json FILE and --npz FILE store the run; the table is printed only without --json."""
    target, rows = tmp_path / "out.json", tmp_path / "out.npz"
    arguments = ["run", "planar3-hold", "--duration", "0.05", "--json", str(target), "--npz", str(rows)]
    assert main(arguments) == 0
    assert json.loads(target.read_text())["robot"] == "planar3"
    with np.load(rows) as data:
        assert data["q"].shape == (50, 3)
        how = json.loads(str(data["settings"]))
    assert (how["scene"], how["seed"], how["set"]) == ("planar3-hold", 0, [])
    assert capfd.readouterr().out == ""


def test_run_shows_a_table(capfd: pytest.CaptureFixture[str]) -> None:
    assert main(["run", "planar3-hold", "--duration", "0.05"]) == 0
    out = capfd.readouterr().out
    for word in ("position", "posture", "RMSE", "unsolved 0", "real time", "completed", "mm", "0.00"):
        assert word in out
    assert not re.search(r"e-\d|-0\b", re.sub(r"residual \S+", "", out)), "rounding errors are no results"


def test_disabled_levels_and_many_sets_go_together(capfd: pytest.CaptureFixture[str]) -> None:
    """Several --set are accepted in one line; a disabled level has no cost."""
    changes = ("levels.2.enabled=false", "levels.3.enabled=false", "limits.position=off")
    sets = [word for change in changes for word in ("--set", change)]
    assert main(["run", "iiwa14-hold", "--duration", "0.05", *sets, "--json", "-"]) == 0
    result = json.loads(capfd.readouterr().out)
    assert len(result["average_cost"]) == 1
    assert result["limits"]["position"]["max_ratio"] is None


@pytest.mark.parametrize("command", ["scenes", "controllers", "robots"])
def test_lists_as_table_and_json(command: str, capfd: pytest.CaptureFixture[str], tmp_path: Path) -> None:
    """Every entry has a name and a description of one line, in both forms."""
    assert main([command, "--json", "-"]) == 0
    entries = json.loads(capfd.readouterr().out)
    assert entries
    assert main([command]) == 0
    table = capfd.readouterr().out
    for entry in entries:
        assert entry["name"] in table
        assert len(entry.get("description", entry.get("title", ""))) > 15
    assert main([command, "--json", str(tmp_path / "list.json")]) == 0
    assert json.loads((tmp_path / "list.json").read_text()) == entries


def test_a_urdf_of_the_catalog_can_be_checked(capfd: pytest.CaptureFixture[str]) -> None:
    """`test_robots_catalog.py` imports the URDFs of all robots."""
    entry = CATALOG["planar3"]
    assert main(["robots", "--check", str(entry.path), "--json", "-"]) == 0
    report = json.loads(capfd.readouterr().out)
    assert report["usable"] is True
    assert len(report["joints"]) == len(entry.M_bar)


def test_a_urdf_that_cannot_be_used_is_reported_with_exit_1(
    tmp_path: Path, capfd: pytest.CaptureFixture[str]
) -> None:
    """The command runs and the check fails: exit code 1, with the reason in the report."""
    path = tmp_path / "still.urdf"
    path.write_text('<robot name="still"><link name="base"/></robot>')
    assert main(["robots", "--check", str(path), "--json", "-"]) == 1
    assert json.loads(capfd.readouterr().out)["usable"] is False


def test_the_example_of_the_readme_runs() -> None:
    """The README's example program runs, and its printed error is small."""
    readme = ROOT / "README.md"
    blocks = re.findall(r"```python\n(.*?)```", readme.read_text(), re.DOTALL) if readme.exists() else []
    if not blocks:
        pytest.skip("README.md has no python block")
    code = blocks[0]
    for name in ("load_robot", "HIMPC", "Plant"):
        assert name in code
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, timeout=300, check=False
    )
    assert done.returncode == 0, done.stderr
    printed = re.findall(r"[-+\d.e]+", done.stdout)
    assert printed
    assert float(printed[-1]) < 5.0


def test_a_state_code_runs_like_its_command_line(capfd: pytest.CaptureFixture[str]) -> None:
    """`run --state CODE` gives the same run as the code's command line; further options are added."""
    state = State(RunSpec("planar3-hold", set=("controller=tdeosf", "plant.payload_kg=0.4"), seed=2))
    results = []
    for given in (["run", "--state", encode(state)], shlex.split(state.run.command_line())[1:]):
        assert main([*given, "--set", "T_s=0.002", "--duration", "0.05", "--json", "-"]) == 0
        result: dict[str, Any] = json.loads(capfd.readouterr().out)
        results.append({key: value for key, value in result.items() if key not in TIMING_KEYS})
    assert results[0] == results[1]
    assert (results[0]["controller"], results[0]["seed"]) == ("tdeosf", 2)


def test_deadlines_are_counted(capfd: pytest.CaptureFixture[str]) -> None:
    """With an assumed computing time of 0.3 ms per knot, the deadline of 1 ms is missed at every tick with N
    = 4, and never with N = 3."""
    for horizon, late in ((3, 0), (4, 50)):
        given = ["--set", "deadline_ms=1", "--set", "solve_ms_per_knot=0.3", "--set", f"horizon={horizon}"]
        assert main(["run", "planar3-hold", *given, "--duration", "0.05", "--json", "-"]) == 0
        assert json.loads(capfd.readouterr().out)["late_ticks"] == late


def test_settings_with_which_the_robot_swings_are_named(capfd: pytest.CaptureFixture[str]) -> None:
    """A warning ends the table and is in the JSON. Which settings are warned of or refused is tested in
    test_lessons_period.py."""
    short = ["run", "panda-hold", "--duration", "0.02", "--set"]
    for change, warned in (("M_bar_scale=0.4", True), ("T_s=0.002", False)):
        assert main([*short, change]) == 0
        last = capfd.readouterr().out.strip().splitlines()[-1]
        assert last.startswith("T_s = 1 ms is too long for panda with this M̄: ") is warned
    assert main([*short, "M_bar_scale=0.4", "--json", "-"]) == 0
    assert "Choose at most 0.82 ms" in json.loads(capfd.readouterr().out)["warning"]
    assert main([*short, "T_s=0.02"]) == 2
    assert "T_s = 20 ms is too long for panda" in capfd.readouterr().err


@pytest.mark.parametrize("command", COMMANDS)
def test_no_flag_says_no_twice(command: str, capsys: pytest.CaptureFixture[str]) -> None:
    """No flag begins with --no-no-, and no flag is listed together with its opposite."""
    with pytest.raises(SystemExit) as ended:
        main([command, "--help"])
    told = capsys.readouterr().out
    assert ended.value.code == 0 and "--help" in told
    flags = set(re.findall(r"--[a-z][a-z-]*", told))
    assert not {each for each in flags if each.startswith("--no-no-")}
    assert not re.search(r"--([a-z-]+), --no-\1", told)


# ---------------------------------------------------------------- velocity level

SQUARE = "ridgeback-ur10-square"


def test_run_prints_the_contract_of_a_velocity_level_scene(tmp_path: Path) -> None:
    """In addition, the result has the keys of parts, line search, base path and mission. The npz file has one
    row per tick."""
    out, rows = tmp_path / "out.json", tmp_path / "rows.npz"
    assert main(["run", SQUARE, "--duration", "1", "--json", str(out), "--npz", str(rows)]) == 0
    result = json.loads(out.read_text())
    assert result["controller"] == "htmpc"
    assert result["limits"]["torque"] == {"max_ratio": None, "applied_max_ratio": None}
    assert set(result["limits"]) == {"torque", "velocity", "position", "acceleration", "jerk"}
    assert [part["name"] for part in result["parts"]] == ["peak", "valley"]
    assert set(result["parts"][0]["ee_error_mm"]) == {"mean", "std", "max"}
    assert result["parts"][1]["normalised_base_error"] is None, "the run ended before it"
    assert set(result["line_search"]) == {"mean_step", "zero_share"}
    assert result["base_path_m"] >= 0.0
    assert (result["completed"], result["completion_time_s"]) == (False, None)
    with np.load(rows) as arrays:
        assert len(arrays["t"]) == 10
        settings = json.loads(str(arrays["settings"]))
    assert (settings["scene"], settings["seed"]) == (SQUARE, 0)


def test_run_shows_people_a_table(capsys: pytest.CaptureFixture[str]) -> None:
    """The table shows the motion of the hand and of the base."""
    assert main(["run", SQUARE, "--duration", "1", "--controller", "htmpc_wpt"]) == 0
    shown = capsys.readouterr().out
    assert "way of the base" in shown
    assert "peak" in shown


# ---------------------------------------------------------------- URDF files of strangers

MARKUP = """<robot name="[/red]"><link name="[/b]"/>
<link name="[/red][bold]"/><joint name="[link=x]" type="{}">
<parent link="[/b]"/><child link="[/red][bold]"/></joint></robot>"""


def test_brackets_in_names_are_text(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    file = tmp_path / "[red]arm.urdf"
    for kind, code in (("revolute", 0), ("[/nothing]", 1)):
        file.write_text(MARKUP.format(kind))
        assert main(["robots", "--check", str(file)]) == code
        assert "[link=x]" in capsys.readouterr().out


def test_a_robot_with_too_many_joints_is_refused_before_it_takes_minutes(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The check and the run refuse the robot with the same message."""
    links = "".join(f'<link name="l{k}"/>' for k in range(61))
    joints = "".join(
        f'<joint name="j{k}" type="continuous"><parent link="l{k}"/><child link="l{k + 1}"/></joint>'
        for k in range(60)
    )
    file = tmp_path / "long.urdf"
    file.write_text(f'<robot name="long">{links}{joints}</robot>')
    assert main(["robots", "--check", str(file), "--json", "-"]) == 1
    assert "60 moving joints; at most 20" in capsys.readouterr().out
    assert main(["run", "hold", "--urdf", str(file)]) == 2
    assert "60 moving joints; at most 20" in capsys.readouterr().err


# ---------------------------------------------------------------- lessons


def test_lessons_are_listed(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["lessons"]) == 0
    assert "a-redundant-arm" in capsys.readouterr().out
    assert main(["lessons", "--json", "-"]) == 0
    listed = json.loads(capsys.readouterr().out)
    assert tuple(lesson["name"] for lesson in listed) == COURSE
    assert all(lesson["question"].endswith("?") and lesson["steps"] for lesson in listed)


def verdicts(fault: str) -> list[Verdict]:
    sound = Verdict("one-task", "s", "It holds.", 1.0, "mm", "≤ 2 mm", "N=1", 3.0)
    return [
        sound,
        Verdict("one-task", "s", "Here.", float("nan"), "mm", "≤ 2 mm", "N=1", float("inf"), fault),
    ]


def test_a_fault_is_exit_code_1(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Each fault gives one sentence and exit code 1; without faults the exit code is 0."""
    monkeypatch.setattr("lessons.teaching.check.check", lambda *_, **__: verdicts("it is false: 3 mm"))
    assert main(["lessons", "--check", "one-task"]) == 1
    assert "one-task, s: “Here.”: it is false: 3 mm" in capsys.readouterr().out.replace("\n", "")
    monkeypatch.setattr("lessons.teaching.check.check", lambda *_, **__: verdicts(""))
    assert main(["lessons", "--check", "one-task"]) == 0


def test_the_verdicts_as_json(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    """Standard output is one valid JSON object, also for checks without a measured value."""
    monkeypatch.setattr("lessons.teaching.check.check", lambda *_, **__: verdicts("it is false"))
    assert main(["lessons", "--check", "one-task", "--json", "-"]) == 1
    result = json.loads(capsys.readouterr().out, parse_constant=pytest.fail)
    assert result["sound"] is False
    (lesson,) = result["lessons"]
    assert [check["sound"] for check in lesson["checks"]] == [True, False]
    assert [check["measured"] for check in lesson["checks"]] == [1.0, None]
    assert lesson["checks"][1]["fault"] == "it is false"
