"""The web server: one page per browser tab, each with a session of its own."""

from __future__ import annotations

import contextlib
import errno
import io
import json
import signal
import socket
import threading
import warnings
import webbrowser
from collections.abc import Callable, Iterator
from urllib.parse import urlsplit

import viser
from viser import _messages, infra

from app.client.progress import Notebook, Progress, progress_from
from app.html.text import block
from app.link.choice import SceneChoice
from app.page.page import Page
from app.panels.run.classroom import add_watching
from app.server.classroom import Classroom, Watcher
from app.server.sessions import GRACE, Sessions
from app.server.wake import WakeUp
from app.worker.reports.start import start
from robots import InputError
from robots.shapes import link_shapes

_LOOPBACK = ("127.0.0.1", "localhost", "::1")
_TOKENS = "himpc-lab-sessions"
_DARK = "himpc-lab-dark"
_PROGRESS = "himpc-lab-lessons"
FIRST = SceneChoice("iiwa14-hold")
"""What the page shows if nothing else is asked for."""


def serve(
    choice: SceneChoice = FIRST,
    *,
    host: str = "127.0.0.1",
    port: int = 8080,
    max_sessions: int = 4,
    classroom: bool = False,
    open_browser: bool = True,
) -> int:
    """Serves the page until Ctrl-C or SIGTERM. Raises InputError for a scene, robot, host or port that
    cannot be used.

    With `classroom` all pages show one session; who types the printed token into the page steers it.
    """
    server = PageServer(choice, host, port, max_sessions, classroom=classroom)
    stop = threading.Event()
    try:
        with _ended_by_signals(stop):
            print(f"himpc-lab ready at {server.url}", flush=True)
            if isinstance(server.sessions, Classroom):
                print(f"instructor's token: {server.sessions.token}", flush=True)
            if open_browser:
                threading.Thread(target=webbrowser.open, args=(server.url,), daemon=True).start()
            while not stop.wait(0.5):
                pass
    finally:
        server.close()
    return 0


@contextlib.contextmanager
def _ended_by_signals(stop: threading.Event) -> Iterator[None]:
    """Ctrl-C and SIGTERM set `stop`; the handlers before come back afterwards."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return
    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, lambda *_: stop.set()) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)


class PageServer:
    """A running server."""

    def __init__(
        self,
        choice: SceneChoice,
        host: str = "127.0.0.1",
        port: int = 8080,
        max_sessions: int = 4,
        grace: float = GRACE,
        classroom: bool = False,
    ) -> None:
        if max_sessions < 1:
            raise InputError(f"max-sessions is {max_sessions}: give 1 or more.")
        # Loaded here once, so that a wrong name or file is one sentence on the terminal, not in a page.
        robot = start(choice.scene(), choice.seed).session.robot
        _check_address(host, port)
        # A tab may close between two lines of ours; that is no news for the terminal.
        warnings.filterwarnings("ignore", "Queued a .* on a closed connection", UserWarning)
        self.sessions = Classroom(choice) if classroom else Sessions(choice, max_sessions, grace)
        self._pages: dict[int, Page] = {}
        self._lock = threading.Lock()
        self._local = host in _LOOPBACK
        # viser greets with a panel of its own; we promise exactly one line.
        with contextlib.redirect_stdout(io.StringIO()):
            self._viser = viser.ViserServer(host=host, port=port, label="himpc-lab", verbose=False)
        if port and self._viser.get_port() != port:
            self.close()
            raise _in_use(host, port)
        self._harden()
        self._keep_awake()
        shown = "127.0.0.1" if host == "0.0.0.0" else f"[{host}]" if ":" in host else host
        self.url = f"http://{shown}:{self._viser.get_port()}"
        self._viser.gui.configure_theme(show_share_button=False, show_logo=False)
        self._viser.on_client_connect(self._connect)
        self._viser.on_client_disconnect(self._disconnect)
        # Meshes take a moment to thin; the first page should not wait for that.
        threading.Thread(target=link_shapes, args=(robot,), daemon=True).start()

    def _harden(self) -> None:
        websockets = self._viser._websock_server
        # Any client could ask for a public tunnel to this machine, button or not.
        websockets.unregister_handler(_messages.ShareUrlRequest)

        async def check(connection: infra.WebsockClientConnection) -> None:
            # A page of any other site may open a WebSocket to localhost; browsers say where it came from.
            live = websockets._live_connections.get(connection.client_id)
            if live is not None and live.request is not None:
                headers = live.request.headers
                if not _same_site(headers.get("Origin"), headers.get("Host", ""), self._local):
                    await live.close(1008, "This page belongs to another site.")

        websockets.on_client_connect(check)

    def _keep_awake(self) -> None:
        """Before a sender first sleeps; viser makes one for all clients and one for each."""
        websockets, loop = self._viser._websock_server, self._viser.get_event_loop()
        websockets._broadcast_buffer.message_event = WakeUp(loop)

        async def keep(connection: infra.WebsockClientConnection) -> None:
            connection.get_message_buffer().message_event = WakeUp(loop)

        websockets.on_client_connect(keep)

    # ---------------------------------------------------------------- clients

    def _connect(self, client: viser.ClientHandle) -> None:
        try:
            tokens = _tokens(client.local_storage.get_item(_TOKENS, timeout=5.0))
            dark = client.local_storage.get_item(_DARK, timeout=5.0) == "1"
            progress = progress_from(client.local_storage.get_item(_PROGRESS, timeout=5.0))
        except (RuntimeError, TimeoutError):
            tokens, dark, progress = [], False, Progress()  # storage is blocked, or the tab is gone already
        notebook = Notebook(progress, lambda text: client.local_storage.set_item(_PROGRESS, text))
        self._admit(client, tokens, dark, notebook)

    def _admit(self, client: viser.ClientHandle, tokens: list[str], dark: bool, notebook: Notebook) -> bool:
        learner = self.sessions.enter(tokens)
        if learner is None:
            self._turn_away(client, tokens, dark, notebook)
            return False
        kept = [token for token in tokens if token != learner.token][-7:]
        client.local_storage.set_item(_TOKENS, json.dumps([*kept, learner.token]))
        page = Page(client, learner, dark, self._local, self._viser.get_event_loop(), notebook)
        page.on_dark = lambda on: client.local_storage.set_item(_DARK, "1" if on else "0")
        if isinstance(learner, Watcher):
            self._let_watch(client, page, learner, lambda given: self._admit(client, given, dark, notebook))
        with self._lock:
            self._pages[client.client_id] = page
        page.start()
        if client.client_id not in self._viser.get_clients():
            self._disconnect(client)  # left while we were building
        return True

    def _let_watch(
        self,
        client: viser.ClientHandle,
        page: Page,
        watcher: Watcher,
        admit: Callable[[list[str]], object],
    ) -> None:
        """A page that only watches, until it has the instructor's token."""

        def take(token: str) -> bool:
            right = isinstance(self.sessions, Classroom) and token == self.sessions.token
            if right:
                page.close()
                admit([token])
            return right

        page.greet = lambda gui: add_watching(gui, take)
        watcher.on_refusal = lambda sentence: client.add_notification(
            "Not steered", sentence, color="orange", auto_close_seconds=4.0
        )

    def _turn_away(
        self, client: viser.ClientHandle, tokens: list[str], dark: bool, notebook: Notebook
    ) -> None:
        client.gui.configure_theme(dark_mode=dark, show_share_button=False, show_logo=False)
        modal = client.gui.add_modal("All places are taken")
        with modal:
            client.gui.add_html(
                block(
                    f"This computer runs a robot for each of {self.sessions.max_sessions} pages, and all are "
                    "in use. Close another tab and try again a few seconds later, or start himpc-lab with "
                    "<code>--max-sessions</code>."
                )
            )
            again = client.gui.add_button("Try again")

        @again.on_click
        def _(_: object) -> None:
            modal.close()
            self._admit(client, tokens, dark, notebook)

    def _disconnect(self, client: viser.ClientHandle) -> None:
        with self._lock:
            page = self._pages.pop(client.client_id, None)
        if page is not None:
            page.close()
            self.sessions.leave(page.learner)

    def close(self) -> None:
        """Ends pages, processes and the server."""
        with self._lock:
            pages, self._pages = list(self._pages.values()), {}
        for page in pages:
            page.close()
        self.sessions.close()
        with contextlib.redirect_stdout(io.StringIO()):
            self._viser.stop()


def _tokens(stored: str | None) -> list[str]:
    """Tokens from the browser's storage, which anybody may have written."""
    try:
        found = json.loads(stored or "[]")
    except ValueError:
        return []
    return [token for token in found if isinstance(token, str)][-8:] if isinstance(found, list) else []


def _same_site(origin: str | None, host: str, local: bool) -> bool:
    """Whether a connection comes from our own page. `local`: we listen on this machine only, so a name
    that merely resolves to it (DNS rebinding) is not ours."""
    if local and urlsplit(f"//{host}").hostname not in _LOOPBACK:
        return False
    return origin is None or urlsplit(origin).netloc == host


def _check_address(host: str, port: int) -> None:
    if not 0 <= port <= 65535:
        raise InputError(f"Port {port} does not exist: give one from 1024 to 65535.")
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    with socket.socket(family, socket.SOCK_STREAM) as probe:
        probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        try:
            probe.bind((host, port))
        except OSError as error:
            if error.errno == errno.EADDRINUSE:
                raise _in_use(host, port) from None
            reason = error.strerror or str(error)
            raise InputError(
                f"Cannot listen on {host}:{port} ({reason}): try --host 127.0.0.1 and another --port."
            ) from None


def _in_use(host: str, port: int) -> InputError:
    other = port + 1 if port < 65535 else port - 1
    return InputError(f"Port {port} on {host} is in use: choose another one, e.g. --port {other}.")
