"""The programs in examples/ run in a short time and print the results that their docstrings announce."""

from __future__ import annotations

import ast
import inspect
import math
import re
import runpy
from pathlib import Path

import pytest

from lessons.parallel import one_by_one

FOLDER = Path(__file__).parents[1] / "examples"
SECONDS = {
    "compare_controllers": 0.1,
    "htmpc_mission": 1.0,
    "obstacles": 0.5,
    "sweep": 0.02,
    "tune_M_bar": 0.05,
}
"""Simulated seconds in the test; 0.2 for all other examples."""
EXAMPLES = sorted(path.stem for path in FOLDER.glob("*.py"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_runs_and_prints_numbers(
    name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """Every line is a label and its values, and every printed number is finite."""
    monkeypatch.chdir(tmp_path)
    main = runpy.run_path(str(FOLDER / f"{name}.py"))["main"]
    serial = {"spread": one_by_one} if "spread" in inspect.signature(main).parameters else {}
    main(seconds=SECONDS.get(name, 0.2), **serial)
    lines = capsys.readouterr().out.splitlines()
    assert lines
    for line in lines:
        label, colon, rest = line.partition(": ")
        assert label and colon and rest, line
        assert not re.search(r"\bnan\b|\binf\b", line), line


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_short_and_says_what_it_prints(name: str) -> None:
    """An example has fewer than 60 lines, including docstring and blank lines, and the README lists it."""
    text = (FOLDER / f"{name}.py").read_text()
    told = ast.get_docstring(ast.parse(text)) or ""
    assert "Prints" in told
    assert len(text.splitlines()) < 60, f"{name} is longer than an example should be"
    assert f"({name}.py)" in (FOLDER / "README.md").read_text()


def test_examples_use_what_is_public() -> None:
    """No name of our packages that begins with an underscore is imported or used as an attribute."""
    for name in EXAMPLES:
        for node in ast.walk(ast.parse((FOLDER / f"{name}.py").read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.ImportFrom) else []
            if isinstance(node, ast.Attribute):
                names.append(node.attr)
            assert not [each for each in names if each.startswith("_") and not each.startswith("__")], name


def test_the_mission_of_the_example_is_completed(capsys: pytest.CaptureFixture[str]) -> None:
    """At the end of the run all three tasks are completed."""
    runpy.run_path(str(FOLDER / "htmpc_mission.py"))["main"]()
    printed = capsys.readouterr().out
    assert re.findall(r"completed: (\w+) at", printed) == ["pick", "drive", "place"]
    times = [float(found) for found in re.findall(r"at ([\d.]+) s", printed)]
    assert times == sorted(times)
    assert all(math.isfinite(t) for t in times)
