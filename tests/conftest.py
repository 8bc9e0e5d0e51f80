"""What every test shares: one thread per matrix product, and the same examples in every run."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import TYPE_CHECKING, Any

# Before NumPy is imported anywhere: the matrices are tiny, and threads only fight over the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hypothesis import settings
from xdist.scheduler import LoadScopeScheduling

if TYPE_CHECKING:
    from playwright.sync_api import Browser

settings.register_profile("same-every-time", derandomize=True, deadline=None, database=None)
settings.load_profile("same-every-time")


_BROWSER = "tests/app/browser"


class OneWorkerForTheBrowser(LoadScopeScheduling):
    """The tests in a browser share one, which one core can draw; a file of the others goes to one worker."""

    def _split_scope(self, nodeid: str) -> str:
        file = nodeid.split("::")[0]
        return _BROWSER if file.startswith(f"{_BROWSER}/") else file


_COMPILE = "from himpc.cascade.compiling import compile_all; compile_all(lambda *_: None)"


def pytest_configure(config: pytest.Config) -> None:
    """What is compiled is compiled before the tests: it takes a minute, for which none of them waits."""
    if not hasattr(config, "workerinput"):
        root = Path(__file__).parents[1]
        subprocess.run([sys.executable, "-c", _COMPILE], cwd=root, check=True, capture_output=True)


def pytest_xdist_make_scheduler(config: pytest.Config, log: Any) -> OneWorkerForTheBrowser:
    return OneWorkerForTheBrowser(config, log)


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    from playwright.sync_api import expect, sync_playwright

    from browsing.hands import CHROMIUM_ARGS, find_chromium

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
def example_urdf() -> Callable[[str], str]:
    """Path of a URDF of example-robot-data; skips where the extra `meshes` is not installed."""
    import pinocchio

    def find(path: str) -> str:
        for parent in Path(pinocchio.__file__).parents:
            found = parent / "share" / "example-robot-data" / "robots" / path
            if found.exists():
                return str(found)
        pytest.skip(f"{path} of example-robot-data is not installed: pip install -e '.[meshes]'")

    return find
