"""A robot in a notebook: its page is shown in the cell, at an address that Jupyter's page can show in a
frame, and Python code controls the same robot."""

from __future__ import annotations

import contextlib
import json
import os
import threading
import weakref
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from html import escape
from importlib.util import find_spec
from pathlib import Path
from typing import Any, Self, final
from urllib.parse import urlsplit

import numpy as np

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Post, Ready
from app.link.process import wait_until
from app.link.threads import on_thread
from app.web.door import SELF, as_origin
from app.web.server import PageServer, ServerOptions
from lessons.events import MoveTarget, Set
from lessons.recording.arrays import named
from lessons.scenes.run_spec import RunSpec
from lessons.settings.settings import SceneSettings
from robots import InputError
from robots.errors import unknown_name

_PROXY, _COLAB = "jupyter_server_proxy", "COLAB_RELEASE_TAG"


@dataclass(frozen=True)
class Surroundings:
    """The Jupyter server of this kernel.

    Attributes:
        address: the address that the user opens, e.g. http://localhost:8888/user/zoe/; only the path if the
            host is not known.
        proxied: whether the server passes on requests for other ports, with jupyter-server-proxy.
    """

    address: str
    proxied: bool

    @property
    def origin(self) -> str | None:
        """The origin of the address as browsers write it; None if only the path is known."""
        parts = urlsplit(self.address)
        return as_origin(f"{parts.scheme}://{parts.netloc}") if parts.netloc else None

    def source(self, port: int, query: str) -> str:
        """Returns the address of a frame that shows the server at a port of this machine. Through Jupyter,
        the address contains no host name, so that it works under any name of the machine."""
        parts = urlsplit(self.address)
        if self.proxied:
            return f"{parts.path.rstrip('/')}/proxy/{port}/?{query}"
        return f"http://{parts.hostname or 'localhost'}:{port}/?{query}"

    @property
    def embedders(self) -> tuple[str, ...]:
        """Returns the origins of the pages that may show the frame. If Jupyter passes on requests, this is
        only the frame's own origin."""
        if self.proxied:
            return (SELF,)
        return () if self.origin is None else (self.origin,)


def surroundings(environment: Mapping[str, str]) -> Surroundings | None:
    """Returns the Jupyter server that started this process; None if there is none."""
    proxied = find_spec(_PROXY) is not None
    if _COLAB in environment:
        return None  # its server has an address that no browser can reach
    prefix = environment.get("JUPYTERHUB_SERVICE_PREFIX")
    if prefix is not None:
        public = urlsplit(environment.get("JUPYTERHUB_PUBLIC_URL", ""))
        where = f"{public.scheme}://{public.netloc}" if public.netloc else ""
        return Surroundings(where + prefix, proxied)
    server = environment.get("JPY_PARENT_PID", "")
    if not server.isdigit() or find_spec("jupyter_core") is None:
        return None
    from jupyter_core.paths import jupyter_runtime_dir

    about = Path(jupyter_runtime_dir()) / f"jpserver-{server}.json"
    try:
        return Surroundings(str(json.loads(about.read_text())["url"]), proxied)
    except (OSError, ValueError, KeyError):
        return None


def outside(environment: Mapping[str, str], port: int) -> tuple[bool, str]:
    """Returns, for a notebook without a Jupyter server whose address is known: whether its browser may reach
    a port of this machine, and a sentence with the next step ("" if there is nothing to say)."""
    if _COLAB in environment:
        return False, (
            "Google Colab does not pass the page on to your browser. Python controls the robot here without "
            "it. For the page, install himpc-lab on your own machine, or himpc-lab[jupyter] in a JupyterHub."
        )
    remote = "VSCODE_PID" in environment or "VSCODE_IPC_HOOK_CLI" in environment
    return True, f"On another machine, first add port {port} in VS Code's tab Ports." if remote else ""


def here() -> Surroundings | None:
    return surroundings(os.environ)


_PATIENCE = 120.0
"""Time, s, within which the simulation must answer. It is long, since the first start after an
installation compiles the controllers."""
_PERIOD = 0.2  # s between two readings of the telemetry


def show(
    scene: str = "iiwa14-hold",
    *,
    lesson: str | None = None,
    set: Sequence[str] = (),
    height: int = 640,
    embed_in: str | None = None,
) -> Lab:
    """Starts a robot and shows its page in the cell.

    Args:
        scene: name of a scene, see `himpc-lab scenes`; lesson: name of a lesson, instead of a scene.
        set: settings as assignments, e.g. "horizon=10".
        height: height of the frame in the cell, pixels.
        embed_in: the origin of the notebook's page, e.g. https://hub.example.org, if it cannot be detected.
            It cannot be detected behind a hub whose public address is unknown here, or if Jupyter is opened
            under another name.

    The cell's output contains the address of the page with its token. The token is valid until `stop` or the
    end of the program; until then, whoever gets the notebook with this output and can reach this machine can
    use the robot.

    Raises:
        InputError: there is no such scene, lesson or setting, or the origin is not valid.
    """
    run = RunSpec(scene, set=tuple(set))
    choice = SceneChoice.of_run(run) if lesson is None else SceneChoice.opening(lesson)
    around = here()
    known = () if around is None else (*around.embedders, *filter(None, [around.origin]))
    origins = tuple(dict.fromkeys((*known, *filter(None, [embed_in]))))
    lab = Lab(choice, origins)
    if around is None:
        reachable, note = outside(os.environ, lab.address[0])
        _display(lab.url if reachable else "", height if origins else 0, note)
    else:
        _display(around.source(*lab.address), height if origins else 0)
    return lab


@final
class Lab:
    """A robot with its server. The server runs in this process until `stop` is called or the program ends."""

    def __init__(self, choice: SceneChoice, embed_in: Sequence[str] = ()) -> None:
        """embed_in: origins of the pages that may show the robot's page in a frame."""
        trusted = [origin for origin in embed_in if "://" in origin]
        self._server = PageServer(
            choice,
            ServerOptions(port=0, classroom=True, all_steer=True, trusted_origins=trusted, embed_in=embed_in),
        )
        (self._learner,) = self._server.sessions.learners
        ended = threading.Event()
        reader = on_thread("rows", _read_on_thread, self._learner, ended)
        self._end = weakref.finalize(self, _end, self._server, ended, reader)

    @property
    def url(self) -> str:
        """The address of the page, with its token, for a browser on this machine."""
        return self._server.guest_link

    @property
    def address(self) -> tuple[int, str]:
        """The port and the query of `url`."""
        parts = urlsplit(self.url)
        return parts.port or 0, parts.query

    @property
    def settings(self) -> SceneSettings:
        """The settings in force."""
        return self._learner.settings_of(self._ready())

    @property
    def tasks(self) -> tuple[str, ...]:
        """The names of the tasks whose targets can be moved."""
        return tuple(task.name for task in self._ready().tasks if task.raw is not None)

    def set(self, path: str, value: Any) -> None:
        """Changes a setting while the robot moves, and returns when the setting is in force. path: as in
        `himpc-lab run SCENE --set PATH=VALUE`. Raises InputError if there is no such setting or value."""
        self.settings.changed(path, value)
        self._learner.send(Post(Set(path, value)))
        self._until(lambda: _has(self.settings, path, value), f"'{path}' is not in force")

    def move(self, task: str, to: Sequence[float]) -> None:
        """Moves a task's target, and returns when the target is in force, also while the robot is paused. to:
        position in m, quaternion (x y z w) or joints in rad. Raises InputError for an unknown task and for
        invalid numbers."""
        ready = self._ready()
        target = next((each.raw for each in ready.tasks if each.name == task and each.raw is not None), None)
        if target is None:
            raise unknown_name("task with a target", task, self.tasks)
        value = tuple(float(each) for each in to)
        if len(value) != target.size or not np.isfinite(value).all():
            raise InputError(f"the target of '{task}' has {target.size} finite numbers, and {to} were given")
        self._learner.send(Post(MoveTarget(task, value)))
        asked = self._learner.ask(_PATIENCE)  # answered after the target is in the mailbox
        before = self._learner.status

        def in_force() -> bool:  # a tick empties the mailbox; while paused, every report follows that
            now = self._learner.status
            if asked is None or now is None or now is before:
                return False
            return not now.running or before is None or now.ticks != before.ticks

        self._until(in_force, "the target did not arrive")

    def rows(self) -> dict[str, Any]:
        """Returns the run since the last reset as arrays with the names of `himpc-lab run --npz`, 100 rows
        per simulated second: `t` (k,) in s, `q` and `tau` (k, n) in rad and N·m, `error/TASK` (k, m), and so
        on."""
        ready = self._ready()
        self._learner.look()
        found = self._learner.read(lambda recording: (recording.layout, recording.whole()))
        if found is None:
            raise InputError("the simulation was stopped: call show again")
        run = self._learner.choice.run
        how = {"scene": run.scene, "urdf": run.urdf, "tip": run.tip, "hold": list(run.hold), "seed": run.seed}
        return named(ready.robot, self.settings, *found, how)

    def stop(self) -> None:
        """Ends the robot and its page. A second call does nothing."""
        self._end()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self.stop()

    def _ready(self) -> Ready:
        self._until(lambda: self._learner.status is not None, "the simulation does not answer")
        assert self._learner.ready is not None
        return self._learner.ready

    def _until(self, condition: Any, otherwise: str) -> None:
        """Waits until a condition is true. Raises InputError if the simulation has ended or takes too
        long."""
        if not self._end.alive:
            raise InputError("the lab was stopped: call show again")

        def settled() -> bool:
            return self._learner.failure is not None or condition()

        if not wait_until(settled, _PATIENCE) or self._learner.failure is not None:
            raise InputError(self._learner.failure or f"{otherwise} after {_PATIENCE:g} s: call show again")


def _has(settings: SceneSettings, path: str, value: Any) -> bool:
    return settings.changed(path, value) == settings


def _read_on_thread(learner: SimulationClient, ended: threading.Event) -> None:
    """Reads the telemetry, also while no page is open."""
    while not ended.wait(_PERIOD):
        learner.look()


def _end(server: PageServer, ended: threading.Event, reader: threading.Thread) -> None:
    ended.set()
    reader.join()
    server.close()


def _display(source: str, height: int, note: str = "") -> None:
    """Shows the page in the cell, or a link to the page and a note if the height is 0; if the source is "",
    only the note. Does nothing outside a notebook."""
    with contextlib.suppress(ImportError):
        from IPython.core.getipython import get_ipython
        from IPython.display import HTML, IFrame, display

        if get_ipython() is not None:
            link = (
                f'<a href="{escape(source)}" target="_blank" rel="noopener">Open the page of this robot</a>'
            )
            text = (link if source else "") + f"<p>{escape(note)}</p>"
            display(IFrame(source, "100%", height) if height and source else HTML(text))
