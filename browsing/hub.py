"""Starts a JupyterHub with the icon of himpc-lab on this machine; functions act as its users."""

from __future__ import annotations

import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import tomllib
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

from playwright.sync_api import Browser, Page

from browsing.browser_actions import SLOW, new_page, press, row, tab
from browsing.lessons import hurry, predict, run
from browsing.wire import eventually
from lessons.course import load_lesson
from lessons.teaching.lesson import Lesson

ROOT = Path(__file__).parents[1]
LESSON = "one-task"
_LONG = 120.0  # s
_GROUP = "jupyter_serverproxy_servers"
_CONFIGURATION = """
c = get_config()
c.JupyterHub.bind_url = {url!r}
c.JupyterHub.hub_port = {hub_port}
c.JupyterHub.db_url = "sqlite:///{folder}/hub.sqlite"
c.JupyterHub.cookie_secret_file = "{folder}/cookie_secret"
c.JupyterHub.authenticator_class = "dummy"
c.Authenticator.allow_all = True
c.JupyterHub.spawner_class = "simple"
c.SimpleLocalProcessSpawner.home_dir_template = "{folder}/{{username}}"
c.Spawner.cmd = [{bin!r} + "/jupyterhub-singleuser"]
c.Spawner.args = ["--allow-root"]
c.Spawner.default_url = "/lab"
c.Spawner.http_timeout = c.Spawner.start_timeout = 120
c.Spawner.environment = {{"HIMPC_LAB_OPTIONS": "--key {folder}/key.txt --lesson {lesson}"}}
c.ConfigurableHTTPProxy.command = [{proxy!r}]
c.ConfigurableHTTPProxy.api_url = "http://127.0.0.1:{api_port}"
c.ConfigurableHTTPProxy.pid_file = "{folder}/proxy.pid"
"""


def find_proxy() -> str | None:
    """Returns the path of the hub's own proxy, or None. Install it with `npm install configurable-http-proxy`
    and add its folder .bin to PATH. The Python package of the same name does not answer with the
    subprotocol of a web socket, so that browsers close the page's connection."""
    found = shutil.which("configurable-http-proxy")
    if found is None or "node" not in Path(found).resolve().read_text(errors="replace")[:200]:
        return None
    return found


@contextmanager
def hub(folder: Path, proxy: str, key: str) -> Iterator[str]:
    """Runs a hub whose users need no password; yields its address. The key signs the learners' progress."""
    ports = [_free_port() for _ in range(3)]
    url = f"http://127.0.0.1:{ports[0]}"
    (folder / "key.txt").write_text(key)
    binaries = str(Path(sys.executable).parent)
    (folder / "configuration.py").write_text(
        _CONFIGURATION.format(
            url=url,
            hub_port=ports[1],
            api_port=ports[2],
            folder=folder,
            bin=binaries,
            proxy=proxy,
            lesson=LESSON,
        )
    )
    environment = {
        **os.environ,
        "PATH": f"{binaries}:{os.environ['PATH']}",
        "PYTHONPATH": f"{entry_point(folder)}:{ROOT}",
    }
    with (folder / "hub.log").open("w") as log:
        process = subprocess.Popen(
            [sys.executable, "-m", "jupyterhub", "-f", "configuration.py"],
            cwd=folder,
            env=environment,
            stdout=log,
            stderr=log,
            start_new_session=True,
        )
        try:
            assert eventually(lambda: _answers(f"{url}/hub/login") or process.poll() is not None, _LONG)
            assert process.poll() is None, (folder / "hub.log").read_text()[-2000:]
            yield url
        finally:
            process.send_signal(signal.SIGTERM)  # the hub stops its users' servers and the proxy
            with suppress(subprocess.TimeoutExpired):
                process.wait(20.0)
            with suppress(ProcessLookupError):
                os.killpg(process.pid, signal.SIGKILL)
            process.wait()


def entry_point(folder: Path) -> Path:
    """Returns a folder that declares the entry point of this checkout; himpc-lab need not be installed."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
    site = folder / "site"
    about = site / "himpc_lab-0.dist-info"
    about.mkdir(parents=True)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: himpc-lab\nVersion: 0\n")
    points = "".join(f"{name} = {where}\n" for name, where in project["entry-points"][_GROUP].items())
    (about / "entry_points.txt").write_text(f"[{_GROUP}]\n{points}")
    return site


def log_in(browser: Browser, url: str, user: str) -> Page:
    """Logs a user in in a new browser profile and returns the page with JupyterLab's launcher."""
    page = new_page(browser, 1300, 700)
    page.goto(f"{url}/hub/login")
    page.fill("#username_input", user)
    page.fill("#password_input", "anything")
    page.click("#login_submit")
    page.wait_for_url(f"**/user/{user}/lab*", timeout=2 * SLOW)
    page.wait_for_selector(_ICON, timeout=2 * SLOW)
    return page


def open_lab(page: Page) -> Page:
    """Presses the icon of himpc-lab; returns the page that opens, as soon as it shows the robot."""
    with page.context.expect_page() as opened:
        page.click(_ICON)
    lab = opened.value
    lab.wait_for_function(
        """() => { const m = window.__viserMutable, t = window.__viserTestpoints;
             return m && t && m.nodeRefFromName["/actual"] && t.rendererInfo.render.triangles > 0; }""",
        timeout=2 * SLOW,
    )
    # The notice "Software WebGL" covers the page and would receive the mouse events.
    lab.add_style_tag(
        content=".mantine-Notifications-root, .mantine-Notifications-root *"
        "{pointer-events:none !important;opacity:0}"
    )
    return lab


def run_first_step(page: Page) -> Lesson:
    """Predicts and runs the first step of the lesson that the hub opens."""
    lesson = load_lesson(LESSON)
    step = lesson.steps[0]
    if step.prediction is not None:
        predict(page, step.prediction)
    hurry(page)
    run(page)
    return lesson


def hand_in(page: Page) -> str:
    """Returns the text that the page writes for the learner to hand in."""
    tab(page, "More")
    tab(page, "Export")
    page.get_by_text("Hand in your progress").click()
    press(page, "Write the text")
    box = row(page, "To hand in").locator("textarea")
    box.wait_for()
    return box.input_value()


def port_of_lab(folder: Path) -> int:
    """Returns the port of the himpc-lab that was started last."""
    told = (folder / "hub.log").read_text()
    return int(re.findall(r"himpc-lab ready at http://localhost:(\d+)/", told)[-1])


_ICON = '.jp-LauncherCard[title*="himpc-lab"]'


def _answers(url: str) -> bool:
    try:
        with urllib.request.urlopen(url, timeout=5.0) as found:
            return found.status == 200
    except (urllib.error.URLError, OSError):
        return False


def _free_port() -> int:
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]
