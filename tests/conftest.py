"""Settings for all tests: each matrix product uses one thread, and every run uses the same random
examples."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp
from typing import TYPE_CHECKING, Any

# These variables are set before NumPy is imported. The matrices are tiny; more threads would only compete for
# the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

# A process in the background ignores Ctrl-C, and every program that a test starts would inherit this.
if signal.getsignal(signal.SIGINT) is signal.SIG_IGN:
    signal.signal(signal.SIGINT, signal.default_int_handler)

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

if TYPE_CHECKING:
    from playwright.sync_api import Browser

settings.register_profile("same-every-time", derandomize=True, deadline=None, database=None)
settings.load_profile("same-every-time")


_TOGETHER = (
    ("tests/app/browser/",),
    (
        "tests/lessons/test_lessons_course.py",
        "tests/lessons/test_lessons_evidence.py",
    ),
    ("tests/test_site.py", "tests/test_site_live.py"),
)
"""Beginnings of the paths of test files that share an expensive resource: a browser, all runs of the course,
or the built site."""


class OneWorkerForWhatIsShared(LoadScopeScheduling):
    """Sends all tests of one entry of `_TOGETHER` to one worker, and all tests of any other file to one
    worker."""

    def _split_scope(self, nodeid: str) -> str:
        shared = (files[0] for files in _TOGETHER if nodeid.startswith(files))
        return next(shared, nodeid.split("::")[0])


_LONG = (
    "tests/app/browser/",
    "tests/app/test_app_memory.py",
    "tests/lessons/test_lessons_grade.py",
    "tests/app/test_app_process.py",
    "tests/lessons/test_lessons_every_controller.py",
    "tests/lessons/test_lessons_cluster.py",
    "tests/lessons/test_lessons_every_task.py",
    "tests/test_site.py",
    "tests/test_site_live.py",
    "tests/lessons/test_lessons_course.py",
    "tests/lessons/test_lessons_evidence.py",
    "tests/commands/test_commands_reproduce.py",
    "tests/commands/test_commands_export.py",
    "tests/robots/test_robots_catalog.py",
    "tests/robots/test_robots_hostile.py",
    "tests/lessons/test_lessons_switch.py",
    "tests/lessons/test_lessons_adaptation.py",
    "tests/app/test_app_lesson.py",
    "tests/test_wheel.py",
    "tests/test_notebook.py",
    "tests/test_examples.py",
)
"""Long tests come first, in particular those that mostly wait, so that no worker runs one alone at the
end."""


_QUICK = (
    "tests/test_structure.py",
    "tests/himpc/test_himpc_limits.py",
    "tests/lessons/test_lessons_one_step.py",
    "tests/himpc/test_himpc_prediction.py",
    "tests/himpc/test_himpc_tasks.py",
    "tests/himpc/test_himpc_cascade.py",
    "tests/himpc/test_htmpc_active_set.py",
    "tests/himpc/test_htmpc_equations.py",
    "tests/lessons/test_lessons_entries.py",
    "tests/lessons/test_lessons_run_spec.py",
    "tests/lessons/test_lessons_settings.py",
    "tests/lessons/test_lessons_stack.py",
)
"""The files of the mark `quick`."""


_MOTION = tuple(
    f"tests/lessons/test_lessons_{name}.py"
    for name in (
        "adaptation",
        "architectures",
        "calm",
        "distances",
        "drag",
        "drags",
        "every_task",
        "live_changes",
        "paper_scene",
        "planar",
        "scenes",
        "tasks",
        "tick",
        "two_arms",
        "velocity",
    )
)
"""Files whose tests assert how a controlled robot moves."""
_TESTED = {
    _MOTION: (
        "robots/",
        "himpc/",
        *(f"lessons/{part}" for part in ("events", "experiments/", "recording/", "runs/")),
        *(f"lessons/{part}/" for part in ("scenes", "session", "settings")),
        "benchmarks/",
    ),
    "tests/robots/": ("robots/",),
    "tests/himpc/": ("robots/", "himpc/"),
    "tests/lessons/": ("robots/", "himpc/", "lessons/", "benchmarks/"),
    "tests/commands/": ("robots/", "himpc/", "lessons/", "app/commands/", "app/__", "app/link/threads.py"),
}
"""What the tests of a package can find wrong: the package and those that it imports. Imports go in one
direction (`tests/test_structure.py`), so that no change of another package can break it. If none of these has
changed, a run of all tests leaves these out, like those that are marked nightly."""
_LESSON_TEXT = re.compile(r"lessons/course/.*\.md")
"""Files that only a test can read whose file names the course, or a module that reads it."""
_ALWAYS = (
    *_QUICK,
    "tests/robots/test_robots_hostile.py",
    "tests/robots/test_robots_isolation.py",
    "tests/robots/test_robots_plant.py",
    "tests/himpc/test_himpc_closed_loop.py",
    "tests/himpc/test_himpc_oracle.py",
    "tests/lessons/test_lessons_course.py",
    "tests/lessons/test_lessons_every_controller.py",
    "tests/lessons/test_lessons_grade_attacks.py",
    "tests/lessons/test_lessons_session.py",
    "tests/commands/test_commands.py",
    "tests/commands/test_commands_interrupted.py",
    "tests/commands/test_commands_light.py",
)
"""Files of these folders that run at every push, with a representative of each kind of test."""
_EVERYTHING = (
    *("tests/conftest.py", "constraints.txt", "pyproject.toml", ".ci/"),
    *("tests/broken_solver.py", "tests/printed_levels.py"),
)
"""Files whose change may break any test."""


def pytest_ignore_collect(collection_path: Path, config: pytest.Config) -> bool | None:
    """With `-m quick` pytest collects only the files in `_QUICK`."""
    if config.getoption("markexpr") != "quick" or collection_path.suffix != ".py":
        return None
    return True if collection_path.relative_to(_ROOT).as_posix() not in _QUICK else None


def pytest_addoption(parser: pytest.Parser) -> None:
    parser.addoption("--nightly", action="store_true", help="run the tests that are marked nightly, too")


def pytest_collection_modifyitems(config: pytest.Config, items: list[pytest.Item]) -> None:
    def rank(item: pytest.Item) -> int:
        return next((k for k, long in enumerate(_LONG) if item.nodeid.startswith(long)), len(_LONG))

    items.sort(key=rank)
    whole = [Path(config.rootpath, each) for each in config.args] == [_ROOT / "tests"]
    for item in items:
        if item.nodeid.startswith(_QUICK):
            item.add_marker(pytest.mark.quick)
        tested = next((of for folder, of in _TESTED.items() if item.nodeid.startswith(folder)), None)
        always = item.nodeid.startswith(_ALWAYS) or item.get_closest_marker("nightly") is not None
        if whole and tested and not always:
            item.add_marker(pytest.mark.nightly(*tested, *_EVERYTHING))
    marks = [mark for item in items for mark in item.iter_markers("nightly")]
    gone = [
        path for path in {path for mark in marks for path in mark.args} if not any(_ROOT.glob(f"{path}*"))
    ]
    if gone:
        raise pytest.UsageError(f"these paths of the mark nightly are no files any more: {sorted(gone)}")
    left_out = [item for item in items if not _runs(item, config)]
    if left_out:
        items[:] = [item for item in items if item not in set(left_out)]
        config.hook.pytest_deselected(items=left_out)


def _runs(item: pytest.Item, config: pytest.Config) -> bool:
    """Whether the test runs. A test that is marked `nightly` runs with `--nightly`, when the command line
    names its file, and when one of the last commits has changed its file, a module of its folder that it may
    import, or a path that the mark names."""
    mark = item.get_closest_marker("nightly")
    if mark is None or config.getoption("nightly") or _few_files(config):
        return True
    file = item.path.relative_to(_ROOT).as_posix()
    beside = re.compile(rf"{re.escape(file.rpartition('/')[0])}/(?!test_)\w+\.py")
    changed = config.stash[_CHANGED]
    if not _reads_lessons(item.path):
        changed = [path for path in changed if not _LESSON_TEXT.fullmatch(path)]
    return any(path.startswith((file, *mark.args)) or beside.match(path) for path in changed)


@cache
def _reads_lessons(path: Path) -> bool:
    return re.search("course|progress|teaching|authoring", path.read_text("utf-8")) is not None


def _changed() -> list[str]:
    """Returns the files that the last ten commits have changed, of which a merge counts as one with all that
    it brings, and those that are changed and not committed. Without a repository these are not known: the
    tests of all packages run, but none that is marked nightly in its file."""

    def git(*words: str) -> list[str]:
        command = ["git", "-C", str(_ROOT), *words]
        return subprocess.run(command, capture_output=True, text=True, check=True).stdout.splitlines()

    try:
        now = git("diff", "--name-only", "HEAD")
        recent = git("log", "--first-parent", "-m", "-n", "10", "--name-only", "--format=")
    except (OSError, subprocess.CalledProcessError):
        return [_EVERYTHING[0]]
    return sorted({*recent, *now} - {""})


_ROOT = Path(__file__).parents[1]
_CHANGED = pytest.StashKey[list[str]]()
_COMPILE = "from himpc.compilation.compiling import compile_all; compile_all(lambda *_: None)"
_COLD = pytest.StashKey[tuple[str, str]]()


def pytest_configure(config: pytest.Config) -> None:
    """Compiles all functions before the tests, because compilation takes a minute. In a fresh clone the first
    run of the command compiles them; its recording is stored for the test that compares it with the second
    run."""
    by_controller: dict[str, Any] | None = getattr(config, "workerinput", None)
    config.stash[_CHANGED] = _changed() if by_controller is None else by_controller["changed"]
    if by_controller is not None or _few_files(config):
        return
    if not any(_ROOT.glob("himpc/**/__pycache__/compiled/*.code")) and "NUMBA_CACHE_DIR" not in os.environ:
        file = Path(mkdtemp(), "first.npz")
        config.add_cleanup(lambda: rmtree(file.parent))
        config.stash[_COLD] = str(file), _run(file)
    subprocess.run([sys.executable, "-c", _COMPILE], cwd=_ROOT, check=True, capture_output=True)


def _few_files(config: pytest.Config) -> bool:
    """Whether the command line names only files, at most three, and no folder. Each of these files then
    compiles only the functions that it needs."""
    named = [Path(str(config.rootpath), each.split("::")[0]) for each in config.args]
    return len(named) <= 3 and all(each.is_file() for each in named)


def pytest_configure_node(node: Any) -> None:
    """Passes the stored first run and the changed files to a worker."""
    node.workerinput["cold"] = node.config.stash.get(_COLD, None)
    node.workerinput["changed"] = node.config.stash[_CHANGED]


def _run(file: Path, **environment: str) -> str:
    """Runs the command, which writes a recording to the file, and returns its standard error."""
    command = ["run", "iiwa14-circle", "--duration", "0.3", "--npz", str(file), "--json", "-"]
    done = subprocess.run(
        [sys.executable, "-m", "app", *command],
        cwd=_ROOT,
        env={**os.environ, **environment},
        capture_output=True,
        text=True,
        check=True,
    )
    return done.stderr


Run = tuple[Path, str]


@pytest.fixture
def first_and_second_run(request: pytest.FixtureRequest, tmp_path: Path) -> tuple[Run, Run]:
    """The recordings and standard errors of two equal runs: the first starts with an empty cache, and the
    second uses the cache that the first has filled."""
    config, second = request.config, tmp_path / "second.npz"
    on_compiled = getattr(config, "workerinput", {"cold": config.stash.get(_COLD, None)})
    if (cold := on_compiled["cold"]) is not None:
        return (Path(cold[0]), cold[1]), (second, _run(second))
    first, cache = tmp_path / "first.npz", str(tmp_path / "cache")
    return (first, _run(first, NUMBA_CACHE_DIR=cache)), (second, _run(second, NUMBA_CACHE_DIR=cache))


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> OneWorkerForWhatIsShared:
    return OneWorkerForWhatIsShared(config, log)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import expect, sync_playwright

    from browsing.browser_actions import CHROMIUM_ARGS, find_chromium

    path = find_chromium()
    if path is None:
        reason = "no Chromium found: install one (Debian: apt-get install chromium) to test the page"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    expect.set_options(timeout=30_000)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=CHROMIUM_ARGS)
        yield chromium
        chromium.close()


@pytest.fixture(scope="session")
def site(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The site, built by the function that the command calls; every warning counts as an error. It has live
    figures, whose kernel takes minutes to compile, if a selected test needs them."""
    from docs.build import build

    out = tmp_path_factory.mktemp("docs") / "site"
    needed = any("live_site" in getattr(item, "fixturenames", ()) for item in request.session.items)
    assert build(out, live=needed) == 0
    return out


@pytest.fixture(scope="session")
def live_site(site: Path) -> Path:
    """The site with live figures."""
    return site


@pytest.fixture(scope="session")
def example_urdf() -> Callable[[str], str]:
    """Returns a function that gives the path of a URDF of example-robot-data; it skips the test if the extra
    `meshes` is not installed."""
    import pinocchio

    def find(path: str) -> str:
        for parent in Path(pinocchio.__file__).parents:
            found = parent / "share" / "example-robot-data" / "robots" / path
            if found.exists():
                return str(found)
        pytest.skip(f"{path} of example-robot-data is not installed: pip install -e '.[meshes]'")

    return find
