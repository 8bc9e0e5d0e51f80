"""The web server: its address, and one page per browser tab, each with its own session."""

from __future__ import annotations

import errno
import socket
import threading
import time
import warnings
from importlib import import_module
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

import viser

from app.adapter import private
from app.classes.words import TEACHER
from app.link.choice import SceneChoice
from app.link.threads import on_thread
from app.page.page import lay_out, starting
from app.web.door import SELF, Door, as_origin, names_of_this_machine
from app.web.guard import ConnectionGuard
from app.web.limits import OF_A_CLASS, ConnectionLimits
from app.web.malloc_tuning import few_arenas, large_arrays_apart
from app.web.passes import VARIABLE, Passes, new_key, new_token, shared
from app.web.sessions import Classroom, Sessions
from app.web.visit import FIRST_TEXT, ServerOptions, Visit
from lessons.scenes.run_spec import RunSpec
from robots import InputError

if TYPE_CHECKING:
    from app.classes.hall import Hall
    from app.classes.sockets import Sockets

LOOPBACK = ("127.0.0.1", "localhost", "::1")
"""Hosts that only this machine can reach."""


def check_address(host: str, port: int) -> None:
    """Raises InputError if no server can listen at this address."""
    if not 0 <= port <= 65535:
        raise InputError(f"Port {port} does not exist: give a port from 1024 to 65535.")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise address_in_use(host, port) from None
            reason = error.strerror or str(error)
            raise InputError(
                f"Cannot listen on {host}:{port} ({reason}): try --host 127.0.0.1 and another --port."
            ) from None


def address_in_use(host: str, port: int) -> InputError:
    """Returns the error for a port at which another program listens."""
    other = port + 1 if port < 65535 else port - 1
    return InputError(f"Port {port} on {host} is in use: choose another one, e.g. --port {other}.")


def local_url(host: str, port: int) -> str:
    shown = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
    return f"http://{shown}:{port}"


def seen_from_outside(host: str, url: str) -> str:
    """Returns the address of the server for other machines without a proxy. This is the machine's address in
    its network if the server listens there, else `url`, the address for this machine."""
    if host not in ("0.0.0.0", "::"):
        return url
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as line:
        try:
            line.connect(("192.0.2.1", 9))  # no machine has this address; nothing is sent
            here = line.getsockname()[0]
        except OSError:
            here = socket.gethostname()
    return f"http://{here}:{urlsplit(url).port}"


FIRST = SceneChoice(RunSpec("iiwa14-hold"))
"""The scene that the page shows by default."""


class PageServer:
    """A running server."""

    def __init__(self, choice: SceneChoice, options: ServerOptions) -> None:
        """Starts the server. choice: the run that the page shows first. Raises InputError if a scene, robot,
        host, port or origin cannot be used, or if the options contradict each other."""
        if options.max_sessions < 1:
            raise InputError(f"max-sessions is {options.max_sessions}: give 1 or more.")
        if options.proxy_only and (options.token is None or not options.ask_token):
            raise InputError(
                "--proxy-only needs the token that the proxy sends: give it with --token-file FILE or "
                f"{VARIABLE}, and leave out --no-token"
            )
        self.options, self.host = options, options.host
        """The address at which the server listens."""
        self.proxies = tuple(map(as_origin, options.trusted_origins))
        """The addresses of the trusted proxies."""
        framing = frozenset(
            each if each == SELF else as_origin(each, "--embed-in") for each in options.embed_in
        )
        _check_choice(choice)
        check_address(options.host, options.port)
        few_arenas()
        large_arrays_apart()
        # A tab may close at any moment, which is not reported on the terminal.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        local = options.host in LOOPBACK
        self.public = not local or bool(self.proxies)
        """Whether people other than the users of this machine can reach the page."""
        self.proxy_only = options.proxy_only
        self.guard = ConnectionGuard(Door())
        alone = Classroom(choice, options.all_steer) if options.classroom else None
        self.sessions = alone or Sessions(choice, options.max_sessions, options.grace)
        self._visits: dict[int, Visit] = {}
        self._closed = False  # if True, no new visit begins
        self._lock = threading.Lock()
        self._sockets: Sockets | None = None
        try:
            self._viser = private.open_server(options.host, options.port, self.guard)
        except BaseException:
            self.sessions.close()
            raise
        found = self._viser.get_port()
        if options.port and found != options.port:
            self.close()
            raise address_in_use(options.host, options.port)
        self.url = local_url(options.host, found)
        self.outside = self.proxies[0] if self.proxies else seen_from_outside(options.host, self.url)
        """The address for other machines, in numbers, as phones rarely find a machine by its name."""
        self._viser.gui.configure_theme(show_share_button=False, show_logo=False)
        lay_out(self._viser.gui)
        self._viser.gui.add_html(f'<div id="{FIRST_TEXT}">{starting(choice)}</div>')
        self._viser.on_client_connect(self._connect)
        self._viser.on_client_disconnect(self._disconnect)
        kept = options.class_file
        self.continued = None if kept is None else kept.read()
        """The class that this server continues; None if there is none."""
        before = self.continued
        self.hall = None if options.class_names is None else self._new_hall(options.class_names)
        owner = None if options.own_files is None and self.hall is None else new_token()
        if before is not None:
            owner = before.owner
        if options.ask_token and options.token is not None:
            self.passes = shared(options.token, owner)
        else:
            token = (before and before.token) or new_token() if options.ask_token else None
            key = new_key() if before is None else bytes.fromhex(before.key)
            self.passes = Passes(token, owner, f"himpc-lab-{found}", key)
        door = Door(
            local, frozenset(self.proxies), self.passes, names_of_this_machine(), options.proxy_only, framing
        )
        if self.hall is None:
            self.guard.open(door, self.sessions, options.refers)
        else:
            self._open_class(door, self.hall)
        self._loading = on_thread("loading", _load_on_thread, choice)

    @property
    def loading(self) -> bool:
        """Whether modules and meshes for the pages are still being loaded."""
        return self._loading.is_alive()

    @property
    def link(self) -> str:
        """The link for the person who started the server, with the owner's secret; without a secret,
        `guest_link`."""
        return self.passes.link(self._entrance, "owner")

    @property
    def guest_link(self) -> str:
        """The link for all other people, with the token if one is needed."""
        return self.passes.link(self.url, "guest")

    @property
    def first_link(self) -> str:
        """The link to the page that opens at the start: the teacher's page of a class, else the page of a
        robot."""
        return self.passes.link(self._entrance, "owner", "" if self.hall is None else TEACHER)

    @property
    def _entrance(self) -> str:
        """The address that the person who started the server can open."""
        return self.outside if self.proxy_only else self.url

    @property
    def teachers_link(self) -> str:
        """The link to the teacher's page of a class, with the owner's secret."""
        return self.passes.link(self.outside, "owner", TEACHER)

    def _new_hall(self, named: bool) -> Hall:
        from app.classes.hall import Hall

        alone = isinstance(self.sessions, Classroom)
        before = self.continued
        code = None if before is None else before.code
        hall = Hall(None if alone else self.sessions, self.sessions.guide(), named, code)
        if before is not None:
            hall.resume(before.state)
        return hall

    def _keep_class(self, now: bool = False) -> None:
        if self.hall is not None and self.options.class_file is not None:
            self.options.class_file.keep(self.hall, self.passes, now)

    def end_class(self) -> None:
        """Ends the class for good: a new start begins another one."""
        if self.options.class_file is not None:
            self.options.class_file.forget()

    def _open_class(self, door: Door, hall: Hall) -> None:
        from app.classes.sockets import Sockets
        from app.web.class_door import ClassDoor

        self._sockets = Sockets(hall, lambda: self.outside, not self.public, self._keep_class)
        self._sockets.start(self._viser.get_event_loop())
        self.guard.crowd = ConnectionLimits(*OF_A_CLASS)
        self.guard.open(door, self.sessions, self.options.refers, ClassDoor(hall, self._sockets))

    # ---------------------------------------------------------------- clients, on viser's loop

    async def _connect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            if self._closed:
                return
            visit = Visit(self._viser, client, self.sessions, self.options, self.hall)
            self._visits[client.client_id] = visit
        await visit.arrive()

    async def _disconnect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            visit = self._visits.pop(client.client_id, None)
        if visit is not None:
            visit.leave()

    def drain(self, seconds: float, now: threading.Event) -> None:
        """Admits no new visitors and informs the pages. Returns when all have left, after `seconds`, or when
        `now` is set."""
        self.guard.close()
        until = time.monotonic() + seconds
        with self._lock:
            visits = list(self._visits.values())
        for visit in visits if seconds > 0 else ():
            visit.tell("The lab stops", (_GO_ON if self.options.refers else _HAND_IN).format(seconds))
        while self._visits and time.monotonic() < until and not now.wait(0.1):
            pass

    def close(self) -> None:
        self.guard.close()
        if self._sockets is not None:
            self._sockets.close()
            self._keep_class(now=True)
        with self._lock:
            self._closed = True
            visits, self._visits = list(self._visits.values()), {}
        for visit in visits:
            visit.leave()
        for visit in visits:
            visit.close()
        self.sessions.close()
        private.stop(self._viser)


_GO_ON = (
    "This computer stops in {:.0f} s. Your page then connects to another computer. Your browser keeps scene, "
    "settings, step and progress; the robot starts again."
)
_HAND_IN = "The lab stops in {:.0f} s: save your data, or hand in your progress (Export)."


def _check_choice(choice: SceneChoice) -> None:
    """Checks a choice before the server starts, so that a wrong name or file gives one sentence on the
    terminal. If the names are not enough for the check, the scene is loaded, which takes a second."""
    if not choice.known:
        from app.worker.simulation import start

        start(choice.scene(), choice.run.seed)


def _load_on_thread(choice: SceneChoice) -> None:
    """Loads the data of pages while the first page connects: the panels, then the meshes, whose
    simplification takes some time."""
    import_module("app.page.scene_view")
    from robots.shapes.link_shapes import link_shapes

    link_shapes(choice.scene().robot)
