"""Lists and help load no numerical library, and lazy packages have all names that they declare."""

from __future__ import annotations

import subprocess
import sys
from importlib import import_module
from pathlib import Path

import pytest

from app.__main__ import COMMANDS

ROOT = Path(__file__).parents[2]
NUMERICS = ("numpy", "scipy", "pinocchio", "mujoco", "numba", "trimesh", "coal", "daqp", "matplotlib")

WATCHED = f"""
import sys
from app.__main__ import main
try:
    code = main(sys.argv[1:])
except SystemExit as stop:
    code = stop.code
assert code == 0, code
assert not set({NUMERICS}) & set(sys.modules), set({NUMERICS}) & set(sys.modules)
"""


LISTS = ("scenes", "controllers", "robots")


@pytest.mark.parametrize("command", [*(f"{name} --help" for name in COMMANDS), "--help", *LISTS])
def test_help_and_lists_load_no_numerics(command: str) -> None:
    """Help names every command."""
    printed = _printed(WATCHED, *command.split())
    if command in LISTS:
        assert len(printed.splitlines()) > 5
    else:
        assert "usage: himpc-lab" in printed
    if command == "--help":
        assert all(f"  {name} " in printed and line in printed for name, line in COMMANDS.items())


def test_the_plant_looks_for_no_window(monkeypatch: pytest.MonkeyPatch) -> None:
    """By default the import of MuJoCo would start processes that look for a window library, and Ctrl-C would
    also reach these processes."""
    monkeypatch.delenv("MUJOCO_GL", raising=False)
    loads = "import sys, app.commands.early, robots.plant; "
    _printed(loads + 'assert "mujoco" in sys.modules and "glfw" not in sys.modules')


def test_the_papers_jobs_load_no_statistics() -> None:
    """Every process that computes the papers' jobs would load `scipy.stats`, which only the outline of one
    figure needs."""
    _printed("import sys, lessons.papers; assert 'scipy.stats' not in sys.modules")


@pytest.mark.parametrize("package", ["robots", "himpc", "himpc.controllers", "himpc.htmpc"])
def test_a_lazy_package_has_all_it_names(package: str) -> None:
    """Every public name is found and gives the same object each time; other names raise AttributeError."""
    module = import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is getattr(module, name)
    with pytest.raises(AttributeError, match="no attribute 'Robto'"):
        module.Robto  # noqa: B018


def _printed(code: str, *arguments: str) -> str:
    """Returns what a program prints that must not fail."""
    command = [sys.executable, "-c", code, *arguments]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    return done.stdout
