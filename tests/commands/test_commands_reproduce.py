"""The commands `reproduce`, `sweep` and `tune`."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from app.__main__ import main
from app.link.process import wait_until
from lessons.parallel import one_by_one

ROOT = Path(__file__).parents[2]
SHORT = ["planar3-circle", "--duration", "0.02"]

WRONG: dict[str, tuple[list[str], str]] = {
    "no such item": (["reproduce", "himpc-table-22"], "himpc-table-2"),
    "a folder that is a file": (["reproduce", "himpc-table-1", "--out", "/dev/null/x"], "--out"),
    "nothing to sweep": (["sweep", *SHORT, "--out", "/tmp/never"], "--over"),
    "no such path": (["sweep", *SHORT, "--out", "/tmp/never", "--over", "M_bar_scal=1:2:2"], "M_bar_scale"),
    "no such scene": (
        ["sweep", "planar3-cirle", "--out", "/tmp/never", "--over", "Q=1:2:2"],
        "planar3-circle",
    ),
    "no such metric": (
        ["sweep", *SHORT, "--out", "/tmp/never", "--over", "Q=1:2:2", "--metric", "tasks.position.rms"],
        "tasks.position.rmse",
    ),
    "a folder nobody may write": (["sweep", *SHORT, "--out", "/dev/null/x", "--over", "Q=1:2:2"], "--out"),
    "no scheduler": (
        ["sweep", *SHORT, "--out", "/tmp/never", "--over", "Q=1:2:2", "--scheduler", "tcp://127.0.0.1:1"],
        "--scheduler",
    ),
    "tuning from nothing": (["tune", *SHORT, "--start", "0"], "--start"),
    "tuning in no steps": (["tune", *SHORT, "--factor", "1"], "--factor"),
    "tuning what is not there": (["tune", "planar3-cirle"], "planar3-circle"),
}


@pytest.mark.parametrize("case", WRONG)
def test_wrong_input_gets_one_sentence_and_exit_2(case: str, capfd: pytest.CaptureFixture[str]) -> None:
    arguments, says = WRONG[case]
    assert main(arguments) == 2
    out, err = capfd.readouterr()
    lines = [line for line in err.strip().splitlines() if line.startswith("himpc-lab: ")]
    assert len(lines) == 1
    assert says in lines[0]
    assert "Traceback" not in err
    assert out.strip() == ""


def test_reproduce_writes_a_report(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    """Two items without runs write report.md and results.json, and the JSON is also printed."""
    arguments = ["reproduce", "himpc-table-1", "himpc-table-4", "--out", str(tmp_path), "--json", "-"]
    assert main(arguments) == 0
    printed = json.loads(capfd.readouterr().out)
    assert printed == json.loads((tmp_path / "results.json").read_text())
    assert [item["name"] for item in printed["items"]] == ["himpc-table-1", "himpc-table-4"]
    assert "himpc-table-4" in (tmp_path / "report.md").read_text()


def test_a_check_that_fails_is_exit_1(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """The command runs, but a claim does not hold, and the command names this claim."""
    from lessons import papers
    from lessons.papers.item import Item, PaperCheck, Section

    section = Section(checks=(PaperCheck("the moon is of cheese", 0.0, False),))
    item = Item("moon", "", "", lambda quick: (), lambda results, quick: section)
    monkeypatch.setitem(papers.ITEMS, "moon", item)
    assert main(["reproduce", "moon", "--out", str(tmp_path)]) == 1
    assert "the moon is of cheese" in capfd.readouterr().out


def cells(folder: Path) -> list[dict[str, Any]]:
    """Returns the finished cells in a sweep's folder."""
    file = folder / "cells.jsonl"
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


def gone(group: int) -> bool:
    """Returns whether all processes of a group have ended."""
    try:
        os.killpg(group, 0)
    except ProcessLookupError:
        return True
    return False


# Each cell takes long enough that the next one is not finished when the first one is found.
SWEEP = ["planar3-circle", "--over", "Q=100:200:8", "--duration", "0.4"]


def test_a_sweep_without_a_folder_has_one_of_its_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """The folder is printed. The same sweep continues there; another sweep gets another folder."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("lessons.parallel.on_cores", one_by_one)
    for over, held in (("Q=100:200:2", 0), ("Q=100:200:2", 2), ("Q=100:300:2", 0)):
        assert main(["sweep", "planar3-circle", "--over", over, "--duration", "0.02"]) == 0
        said = capsys.readouterr()
        assert f"2 cells, {held} of them already in out/sweeps/planar3-circle-Q-" in said.err
        assert "results: out/sweeps/planar3-circle-Q-" in said.out
        assert re.search(r"smallest tasks\.position\.rmse: [\d.]+ mm at Q = ", said.out)
    folders = list((tmp_path / "out" / "sweeps").iterdir())
    assert len(folders) == 2 and all((each / "results.json").exists() for each in folders)


def test_a_sweep_that_is_stopped_twice_carries_on(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A sweep that is interrupted by SIGINT or SIGTERM prints how many cells are finished and leaves no
    process. The same command then carries on: with the same results, as test_lessons_sweep.py tests."""
    part = tmp_path / "part"
    for stop in (signal.SIGINT, signal.SIGTERM):
        before = len(cells(part))
        process = subprocess.Popen(
            [sys.executable, "-m", "app", "sweep", *SWEEP, "--out", str(part)],
            cwd=ROOT,
            stderr=subprocess.PIPE,
            text=True,
            start_new_session=True,
        )
        assert wait_until(lambda before=before: len(cells(part)) > before, 120.0)
        if stop == signal.SIGINT:
            os.killpg(process.pid, stop)
        else:
            process.send_signal(stop)
        _, err = process.communicate(timeout=60)
        assert process.returncode == 130
        assert "the same command continues" in err
        assert "Traceback" not in err
        # Python's own helper process ends a moment after its parent.
        assert wait_until(lambda group=process.pid: gone(group), 30.0)
        assert before < len(cells(part)) < 8
    monkeypatch.setattr("lessons.parallel.on_cores", one_by_one)
    assert main(["sweep", *SWEEP, "--out", str(part)]) == 0
    assert len(cells(part)) == 8 and (part / "map.png").is_file()


def test_tune_prints_its_steps(capfd: pytest.CaptureFixture[str]) -> None:
    """M̄ grows by the factor until the accuracy is reached, and the result is printed as an assignment."""
    arguments = ["tune", "planar3-circle", "--duration", "0.5", "--start", "0.2", "--accuracy", "1e-4"]
    assert main(arguments) == 0
    lines = capfd.readouterr().out.splitlines()
    assert lines[0].startswith(" 1. M̄ × 0.2 ")
    assert lines[-2].endswith("satisfactory")
    assert "--set M_bar=[" in lines[-1]


def test_tune_stops_when_the_torque_is_noisy(capfd: pytest.CaptureFixture[str]) -> None:
    """With coarse encoders the torque becomes noisy, so that M̄ stops growing before an unreachable accuracy
    is reached."""
    coarse = ["--set", "plant.encoder_resolution_deg=0.005"]
    arguments = ["tune", "planar3-circle", "--duration", "0.3", "--start", "0.02", "--accuracy", "1e-9"]
    assert main([*arguments, *coarse, "--json", "-"]) == 0
    data = json.loads(capfd.readouterr().out)
    verdicts = [step["verdict"] for step in data["steps"]]
    assert verdicts == [*["go on"] * (len(verdicts) - 1), "noisy"]
    assert data["chosen"]["scale"] < data["steps"][-1]["scale"]
