"""A built wheel works in a separate environment, outside the checkout."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Sequence
from pathlib import Path

import pytest

from himpc.compilation.compiling import compile_all

ROOT = Path(__file__).parents[1]
PACKAGES = ("robots", "himpc", "lessons", "app", "himpc_lab")
_ELSEWHERE = "NUMBA_CACHE_DIR" in os.environ
"""Whether the tester keeps compiled code in another folder; then there is none to copy."""


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from the files under version control, as from a fresh clone."""
    folder = tmp_path_factory.mktemp("wheel")
    listed = subprocess.run(["git", "ls-files", "-z"], cwd=ROOT, capture_output=True, text=True, check=True)
    for name in filter(None, listed.stdout.split("\0")):
        if name.split("/")[0] in (*PACKAGES, "pyproject.toml", "README.md", "LICENSE"):
            copy = folder / "source" / name
            copy.parent.mkdir(parents=True, exist_ok=True)
            copy.write_bytes((ROOT / name).read_bytes())
    told = [
        sys.executable,
        "-m",
        "pip",
        "wheel",
        "-q",
        "--no-deps",
        "--no-build-isolation",
        "-w",
        str(folder),
    ]
    done = subprocess.run([*told, str(folder / "source")], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    (found,) = folder.glob("*.whl")
    return found


@pytest.fixture(scope="module")
def command(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The program `himpc-lab` of an environment that contains the wheel and uses the dependencies of the
    environment of the tests."""
    home = tmp_path_factory.mktemp("venv")
    venv.create(home, with_pip=False, symlinks=True)
    with zipfile.ZipFile(wheel) as archive:
        script = next(name for name in archive.namelist() if name.endswith("entry_points.txt"))
        assert "himpc-lab = app.commands.console:main" in archive.read(script).decode()
    pip = [
        sys.executable,
        "-m",
        "pip",
        "--python",
        str(home / "bin" / "python"),
        "install",
        "-q",
        "--no-deps",
    ]
    # If PYTHONPATH contained the checkout, pip would consider the package as installed.
    alone = {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}
    done = subprocess.run(
        [*pip, "--no-index", str(wheel)], env=alone, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    here = Path(sysconfig.get_path("purelib"))
    (there,) = home.glob("lib/python*/site-packages")
    # Here the checkout is installed in place by an import finder. The new environment must not use this
    # finder, so its .pth file lists only the folders of the dependencies.
    (there / "dependencies.pth").write_text(f"{here}\n{here / 'cmeel.prefix' / there.relative_to(home)}\n")
    _take_compiled_code_along(there)
    return home / "bin" / "himpc-lab"


def _take_compiled_code_along(there: Path) -> None:
    """Copies the compiled code into the new environment, because its compilation takes a minute and is not
    tested here."""
    compile_all(lambda *_: None)
    found = [*ROOT.glob("himpc/**/__pycache__/compiled/*.code")]
    assert found or _ELSEWHERE
    for kept in found:
        folder = there / kept.relative_to(ROOT).parent
        folder.mkdir(mode=0o700, parents=True, exist_ok=True)
        shutil.copy2(kept, folder)


def run(command: Path, folder: Path, what: Sequence[str]) -> str:
    """Runs the command in `folder` without the import paths of this process, and returns its output."""
    processor = {name: value for name, value in os.environ.items() if name == "NUMBA_CPU_NAME"}
    environment = {"HOME": str(folder), "PATH": "/usr/bin:/bin", "LANG": "C.UTF-8", **processor}
    done = subprocess.run(
        [str(command), *what], cwd=folder, env=environment, capture_output=True, text=True, check=False
    )
    assert done.returncode == 0, done.stderr
    assert "compiling" not in done.stderr or _ELSEWHERE
    return done.stdout


def test_everything_that_is_no_code_is_in_it(wheel: Path) -> None:
    """The wheel contains every file of the packages that is under version control."""
    listed = subprocess.run(
        ["git", "ls-files", "-z", *PACKAGES], cwd=ROOT, capture_output=True, text=True, check=True
    )
    with zipfile.ZipFile(wheel) as archive:
        held = set(archive.namelist())
    assert set(filter(None, listed.stdout.split("\0"))) - held == set()


def test_it_runs_without_the_checkout(command: Path, tmp_path: Path) -> None:
    """The installed command lists the scenes, finds a lesson's file, and computes the numbers of a run."""
    python = command.parent / "python"
    home = run(python, tmp_path, ["-c", "import app, robots; print(app.__file__); print(robots.__file__)"])
    assert str(ROOT) not in home
    scenes = json.loads(run(command, tmp_path, ["scenes", "--json", "-"]))
    assert "planar3-circle" in {scene["name"] for scene in scenes}
    result = json.loads(
        run(
            command,
            tmp_path,
            ["run", "planar3-circle", "--duration", "0.02", "--json", "-"],
        )
    )
    assert result["finite"]
    lamp = "from lessons.course import load_lesson; print(load_lesson('your-robot').urdf)"
    assert "lamp" in run(python, tmp_path, ["-c", lamp])
