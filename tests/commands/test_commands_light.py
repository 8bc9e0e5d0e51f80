"""Lists and help load no numerical library, and lazy packages have all names that they declare."""

from __future__ import annotations

import os
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


@pytest.mark.parametrize("command", [*(f"{name} --help" for name in COMMANDS), "--help"])
def test_help_loads_no_numerics(command: str) -> None:
    done = _watched(command.split())
    assert done.returncode == 0, done.stderr
    assert "usage: himpc-lab" in done.stdout


@pytest.mark.parametrize("command", ["scenes", "controllers", "robots"])
def test_lists_load_no_numerics(command: str) -> None:
    done = _watched([command])
    assert done.returncode == 0, done.stderr
    assert len(done.stdout.splitlines()) > 5


def test_the_plant_looks_for_no_window() -> None:
    """By default the import of MuJoCo would start processes that look for a window library, and Ctrl-C would
    also reach these processes."""
    code = """
import sys
import app.commands.early, robots.plant
assert "mujoco" in sys.modules and "glfw" not in sys.modules
"""
    environment = {name: value for name, value in os.environ.items() if name != "MUJOCO_GL"}
    done = subprocess.run(
        [sys.executable, "-c", code], cwd=ROOT, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr


def test_the_papers_jobs_load_no_statistics() -> None:
    """Every process that computes the papers' jobs would load `scipy.stats`, which only the outline of one
    figure needs."""
    code = "import sys, lessons.papers; assert 'scipy.stats' not in sys.modules"
    done = subprocess.run([sys.executable, "-c", code], cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_help_names_every_command() -> None:
    printed = _watched(["--help"]).stdout
    assert all(f"  {name} " in printed and line in printed for name, line in COMMANDS.items())


@pytest.mark.parametrize("package", ["robots", "himpc", "himpc.controllers", "himpc.htmpc"])
def test_a_lazy_package_has_all_it_names(package: str) -> None:
    """Every public name is found and gives the same object each time; other names raise AttributeError."""
    module = import_module(package)
    for name in module.__all__:
        assert getattr(module, name) is getattr(module, name)
    with pytest.raises(AttributeError, match="no attribute 'Robto'"):
        module.Robto  # noqa: B018


def _watched(arguments: list[str]) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-c", WATCHED, *arguments],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=120,
        check=False,
    )
