"""Output that cannot be written: one sentence, exit code 2, and the file that was there before is whole."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from app.__main__ import main
from app.commands.output import machine_failure
from lessons.outputs import write_files
from lessons.parallel import one_by_one

ROOT = Path(__file__).parents[2]
FULL = Path("/dev/full")
HELD = ["run", "planar3-hold", "--duration"]


def limited(limit: str, *arguments: str, **environment: str) -> subprocess.CompletedProcess[str]:
    """Runs a command in a shell with a limit, e.g. "ulimit -f 1", which acts like a full disk."""
    return subprocess.run(
        ["bash", "-c", f'{limit}; exec "$0" -m app "$@"', sys.executable, *arguments],
        cwd=ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )


def assert_one_sentence(done: subprocess.CompletedProcess[str], *words: str) -> None:
    *_, last = done.stderr.strip().splitlines()
    assert done.returncode == 2, done.stderr
    assert "Traceback" not in done.stderr
    assert done.stderr.count("himpc-lab: ") == 1
    assert last.startswith("himpc-lab: ") and all(word in last for word in words), last


def test_a_full_disk_leaves_old_results_whole(tmp_path: Path) -> None:
    rows, result = tmp_path / "x.npz", tmp_path / "y.json"
    assert main([*HELD, "1", "--npz", str(rows)]) == 0
    assert main([*HELD, "0.1", "--json", str(result)]) == 0
    before = rows.read_bytes(), result.read_bytes()
    assert_one_sentence(limited("ulimit -f 40", *HELD, "4", "--npz", str(rows)), "--npz", "File too large")
    assert_one_sentence(limited("ulimit -f 1", *HELD, "0.2", "--json", str(result)), "--json")
    assert (rows.read_bytes(), result.read_bytes()) == before
    assert sorted(os.listdir(tmp_path)) == ["x.npz", "y.json"]


@pytest.mark.parametrize(
    "line",
    [
        ["reproduce", "himpc-table-1", "--out", "."],
        ["sweep", "planar3-hold", "--duration", "0.02", "--over", "Q=1:2:2", "--out", "."],
        ["new", "scene", "mine.py"],
        ["grade", "--autograder", "joint-pd", "--out", "folder"],
    ],
    ids=lambda line: line[0],
)
def test_every_command_that_writes_says_one_sentence(
    line: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With a full disk no command leaves a file of which only the beginning was written."""
    monkeypatch.setattr("lessons.parallel.on_cores", one_by_one)
    where = [str(tmp_path / word) if word in (".", "mine.py", "folder") else word for word in line]
    if line[0] == "sweep":  # with the folder of a sweep that is complete, only results.json is written
        assert main(where) == 0
        (tmp_path / "map.png").unlink()
    if line[0] == "reproduce":
        (tmp_path / "report.md").write_text("old")
    held = {path: path.read_bytes() for path in tmp_path.iterdir()}
    assert_one_sentence(limited("ulimit -f 0" if line[0] == "new" else "ulimit -f 1", *where), "written")
    assert all(path.read_bytes() == content for path, content in held.items())
    if line[0] != "grade":
        assert set(tmp_path.iterdir()) == set(held)


def test_a_sweep_continues_after_the_disk_was_full(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("lessons.parallel.on_cores", one_by_one)
    line = ["sweep", "planar3-hold", "--duration", "0.02", "--over", "Q=1:2:3", "--out", str(tmp_path)]
    assert_one_sentence(limited("ulimit -f 2", *line), "--out", "continues")
    assert main(line) == 0
    assert len(json.loads((tmp_path / "results.json").read_text())["cells"]) == 3


def test_several_files_are_replaced_together(tmp_path: Path) -> None:
    """If one of several files cannot be written, none of the others is exchanged; links and modes stay."""
    old, link = tmp_path / "old", tmp_path / "link"
    old.write_text("old")
    old.chmod(0o640)
    link.symlink_to(old)
    with pytest.raises(OSError, match="directory"):
        write_files({old: "new", tmp_path / "none" / "there": "new"})
    assert old.read_text() == "old"
    write_files({link: "new"})
    assert link.is_symlink()
    assert (old.read_text(), old.stat().st_mode & 0o777) == ("new", 0o640)
    assert sorted(os.listdir(tmp_path)) == ["link", "old"]


def test_the_file_of_npz_is_the_one_that_was_named(
    tmp_path: Path, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    """NumPy would add an extension; a folder is refused before the run."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    assert main([*HELD, "0.01", "--npz", "rows"]) == 0
    with np.load(tmp_path / "rows") as data:
        assert data["q"].shape == (10, 3)
    monkeypatch.setattr("lessons.recording.run.run", None)  # nothing is simulated
    assert main([*HELD, "0.01", "--npz", "folder"]) == 2
    assert "--npz folder: cannot be written (Is a directory)" in capfd.readouterr().err
    assert sorted(os.listdir(tmp_path)) == ["folder", "rows"]


@pytest.mark.skipif(not FULL.exists(), reason="only Linux has a device that is always full")
@pytest.mark.parametrize("line", [["scenes"], ["scenes", "--json", "-"], ["--help"], [*HELD, "0.01"]])
def test_standard_output_on_a_full_disk(line: list[str]) -> None:
    assert_one_sentence(limited(f"exec >{FULL}", *line), "output cannot be written", "No space left")


@pytest.mark.skipif(not FULL.exists(), reason="only Linux has a device that is always full")
def test_a_recording_on_a_full_disk(capfd: pytest.CaptureFixture[str]) -> None:
    assert main([*HELD, "0.01", "--npz", str(FULL)]) == 2
    said = capfd.readouterr().err.strip().splitlines()
    assert len(said) == 1 and f"--npz {FULL}" in said[0] and "No space left" in said[0]


def test_an_encoding_without_the_characters() -> None:
    done = limited("true", *HELD, "0.05", PYTHONIOENCODING="ascii")
    assert_one_sentence(done, "ascii lacks", "PYTHONIOENCODING=utf-8")


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="only Linux limits a process in this way")
@pytest.mark.parametrize("kilobytes", [150_000, 300_000, 400_000])
def test_too_little_memory(kilobytes: int) -> None:
    """The libraries report this in different ways, most of them not as MemoryError."""
    assert_one_sentence(limited(f"ulimit -v {kilobytes}", *HELD, "0.05"), "memory")


def test_too_little_memory_for_pythons_parser() -> None:
    """Python 3.11 said this with 300 MB, once in many runs, when it compiled a module that it imported."""
    told = machine_failure(ValueError("field 'target' is required for AnnAssign"))
    assert told is not None and "memory" in told
    assert machine_failure(ValueError("a field is missing")) is None


@pytest.mark.parametrize("seed", [-1, 10**40])
@pytest.mark.parametrize("line", [["run"], ["tune"], ["sweep", "--over", "Q=1:2:2", "--out", "/tmp/never"]])
def test_a_seed_outside_its_range(seed: int, line: list[str], capfd: pytest.CaptureFixture[str]) -> None:
    assert main([line[0], "planar3-hold", *line[1:], "--duration", "0.01", "--seed", str(seed)]) == 2
    assert f"seed is {seed}: give a whole number from 0 to {2**63 - 1}" in capfd.readouterr().err
