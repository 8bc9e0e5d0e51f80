"""One browser tab, from its first message until it is closed. Its place (scene or step) is stored in the
browser, so that another server at the same address can continue from there. Every tab has its own storage,
which remains after a reload and after the end of the server. viser reads only the storage that all tabs
share; a script copies the value there, under a key of this visit."""

from __future__ import annotations

import asyncio
import hashlib
import json
import secrets
import threading
from collections.abc import Callable, Sequence
from concurrent.futures import Future, ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import partial
from importlib.resources import files
from typing import TYPE_CHECKING, Any

import viser

from app.adapter import private
from app.adapter.names import STORED
from app.adapter.private import print_exception, unless_removed
from app.client.simulation_client import SimulationClient
from app.html.text import block
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.process import why_not
from app.page.page import Page
from app.panels.run.classroom import ClassCard, add_watching
from app.tab.comfort import ASK_MOTION, ASK_WINDOW, DARK, MOTION, NAME_TAB, REDUCED, Comfort, window_size
from app.tab.visitor import Notebook, Visitor
from app.web.guard import GuardedConnection
from app.web.inlet import Inlet
from app.web.limits import UPLOADS, Uploads
from app.web.sessions import GRACE, Classroom, Sessions, Watcher, tokens_of
from lessons.course import COURSE
from lessons.own.files import Folder
from lessons.replay.progress import load_progress
from robots import InputError

if TYPE_CHECKING:
    from app.classes.hall import Hall
    from app.web.class_file import ClassFile

_KEY = "himpc-lab-place"
_DROP = files("app.tab").joinpath("dropped.js").read_text("utf-8")


def place_asked(key: str) -> str:
    """Returns the script that makes the tab's value readable under `key`."""
    kept = f"sessionStorage.getItem({json.dumps(_KEY)})"
    return f'try {{ localStorage.setItem({json.dumps(STORED + key)}, {kept} ?? ""); }} catch {{}}'


def place_kept(text: str) -> str:
    """Returns the script that stores the value in the tab."""
    return f"try {{ sessionStorage.setItem({json.dumps(_KEY)}, {json.dumps(text)}); }} catch {{}}"


def place_written(choice: SceneChoice, code: str, start: SceneChoice) -> str:
    """Returns the place of a page as text: the step of a lesson, or the code of the scene and its settings.
    code: "" if there is none, e.g. for an uploaded robot, which other servers do not have; start: the choice
    that new pages of this server show; only servers with the same start continue from the place."""
    place: dict[str, str | int] = {"start": _digest(start)}
    exercise = choice.exercise
    if exercise is not None:
        return json.dumps({**place, "lesson": exercise.lesson, "step": exercise.place + 1})
    return json.dumps({**place, "code": code}) if code else ""


def place_read(text: str | None, start: SceneChoice) -> SceneChoice | None:
    """Returns the choice that a tab stored; None if it cannot be loaded. The text is not trusted."""
    try:
        found = json.loads(text or "{}")
        if not isinstance(found, dict) or found.get("start") != _digest(start):
            return None
        lesson, step, code = found.get("lesson"), found.get("step"), found.get("code")
        if lesson in COURSE and type(step) is int:
            return SceneChoice.of_lesson(LessonPlace.at(str(lesson), step)).admitting(start)
        if not isinstance(code, str):
            return None
        from lessons.replay.state import decode

        return SceneChoice.of_state(decode(code)).admitting(start)
    except (InputError, ValueError, RecursionError, TypeError):
        return None


def _digest(start: SceneChoice) -> str:
    return hashlib.sha256(repr(start).encode()).hexdigest()[:16]


THREADS = 4
WAITING = 64
"""Largest number of calls that wait for a thread; further calls are dropped."""


class Workers(ThreadPoolExecutor):
    """The threads of one page, on which its callbacks run without blocking other pages. Calls beyond their
    limit are dropped, and all calls after the shutdown."""

    def __init__(self) -> None:
        super().__init__(THREADS, thread_name_prefix="page")
        self._room = threading.Semaphore(THREADS + WAITING)

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        """Submits a call; returns a future with the result None if the call is dropped."""
        if not self._room.acquire(blocking=False):
            return _dropped()
        try:
            future = super().submit(unless_removed, fn, *args, **kwargs)
        except RuntimeError:  # the pool was shut down when its page closed
            self._room.release()
            return _dropped()
        future.add_done_callback(lambda _: self._room.release())
        return future


def _dropped() -> Future[Any]:
    future: Future[Any] = Future()
    future.set_result(None)
    return future


STORAGE = 5.0
"""Time, s, within which a browser must send its stored values."""
FIRST_TEXT = "himpc-lab-first"
"""Identifier, in the browser's document, of the text that all browsers show before their own page."""
_OWN_TEXT = f"""(() => {{
  const style = document.createElement("style");
  style.textContent = "#{FIRST_TEXT} {{ display: none }}";
  document.head.append(style);
}})()"""
_TOKENS = "himpc-lab-sessions"
_PROGRESS = "himpc-lab-lessons"
_ELSEWHERE = 3.0  # s for which a full server's page waits before it connects again
_PERIOD = 1.0  # s between two checks of the page's place
_GOES_ON = (
    "You continue where you were",
    "The robot starts again, with the settings or the step that you had.",
)
_LONGEST = 100_000  # largest number of characters of a stored value


@dataclass(frozen=True)
class ServerOptions:
    """How a server is started.

    Attributes:
        host, port: address at which the server listens.
        max_sessions: number of pages with a robot of their own.
        grace: time, s, for which a session continues after its tab was closed.
        classroom: all pages show one session; pages on which the token was typed control the session.
        trusted_origins: addresses of proxies that may serve the page.
        ask_token: whether the page asks for a token.
        own_files: folder whose files the owner's page may open and run by their paths; None: no page may
            open files.
        key: signs the learners' progress.
        token: used in place of a random token.
        refers: a full server answers 503, so that a proxy tries the next server, and a page that finds all
            places taken connects again, perhaps to another server.
        class_names: whether a class is asked for names; None: there is no class.
        proxy_only: only a proxy that sends the token in its header is admitted.
        embed_in: origins whose pages may show the page in a frame.
        all_steer: every page of a classroom controls the robot.
        class_file: the file with which the class continues after a new start.
    """

    host: str = "127.0.0.1"
    port: int = 8080
    max_sessions: int = 4
    grace: float = GRACE
    classroom: bool = False
    trusted_origins: Sequence[str] = ()
    ask_token: bool = True
    own_files: Folder | None = None
    key: bytes | None = None
    token: str | None = None
    refers: bool = False
    class_names: bool | None = None
    proxy_only: bool = False
    embed_in: Sequence[str] = ()
    all_steer: bool = False
    class_file: ClassFile | None = None


class Visit:
    """One visit of a browser. Each visit has a thread that admits and closes the visit. Callbacks run on a
    few other threads. Therefore no visit blocks viser's loop."""

    def __init__(
        self,
        server: viser.ViserServer,
        client: viser.ClientHandle,
        sessions: Sessions | Classroom,
        options: ServerOptions,
        room: Hall | None = None,
    ) -> None:
        """room: the class, if there is one."""
        self._server = server
        self._client = client
        self._sessions = sessions
        self._options, self._room, self._own_files = options, room, options.own_files
        self._page: Page | None = None
        self._left = False
        self._seat = ""
        self._asking: asyncio.Future[tuple[str | None, ...]] | None = None
        self._stored: str | None = None  # the place that the tab stored last
        self._workers = Workers()
        self._steps = ThreadPoolExecutor(1, thread_name_prefix="visit")
        private.give_workers(client, self._workers)
        private.keep_short(server, client)
        inlet = Inlet(client)
        connection = private.connection_of(server, client)
        if not (isinstance(connection, GuardedConnection) and connection.is_owners):
            self._own_files = None
        self._teaches = isinstance(connection, GuardedConnection) and connection.teaches
        self._account = connection.account if isinstance(connection, GuardedConnection) else ""
        # All accounts of a hub have one origin. A browser stores their values together, under different keys.
        self._progress_key, self._tokens_key = (
            f"{key}-{self._account}" if self._account else key for key in (_PROGRESS, _TOKENS)
        )
        if isinstance(connection, GuardedConnection):
            connection.refuse = partial(inlet.say, "Not taken")
            connection.uploads = Uploads(
                partial(private.unfinished_uploads, client),
                partial(private.forget_upload, client),
                self._refuse_upload,
            )

    async def arrive(self) -> None:
        """Starts the visit on viser's loop, unless the visit has ended already. A browser that does not
        answer is treated as a new browser."""
        private.run_script(self._client, NAME_TAB)
        private.run_script(self._client, ASK_MOTION)
        private.run_script(self._client, _DROP)
        here = f"himpc-lab-place-{secrets.token_hex(8)}"
        size = f"{here}-window"
        private.run_script(self._client, place_asked(here))
        private.run_script(self._client, ASK_WINDOW % (STORED, size))
        keys = (self._tokens_key, DARK, self._progress_key, MOTION, here, size)
        self._asking = asyncio.ensure_future(private.read_storage(self._client, keys, STORAGE))
        if self._left:  # `leave` may have found nothing to cancel
            self._asking.cancel()
        try:
            found = await self._asking
        except asyncio.CancelledError:
            return  # the tab was closed
        for key in (here, size):
            self._client.local_storage.remove_item(key)
        short = [text if text and len(text) <= _LONGEST else None for text in found]
        tokens, dark, progress, motion, kept, window = short
        reduced = motion == REDUCED and isinstance(self._sessions, Sessions)
        self._visitor = Visitor(
            self._client,
            self._server.get_event_loop(),
            self._own_files,
            Notebook(
                load_progress(progress, self._options.key, self._account),
                lambda text: self._keep(self._progress_key, text),
                self._options.key,
                self._account,
            ),
            Comfort(self._client, reduced, window_size(window), dark == "1"),
        )
        self._then(tokens_of(tokens), kept)
        self._watch()

    def leave(self) -> None:
        """Ends the visit after the tab was closed. Returns at once."""
        if not self._left:
            self._left = True
            if self._asking is not None:
                self._server.get_event_loop().call_soon_threadsafe(self._asking.cancel)
            self._steps.submit(self._end).add_done_callback(print_exception)
            self._steps.shutdown(wait=False)

    def close(self) -> None:
        """As `leave`, but waits until the visit has ended."""
        self.leave()
        self._steps.shutdown(wait=True)

    # ---------------------------------------------------------------- steps, on a thread of their own

    def _then(self, tokens: Sequence[str], kept: str | None = None) -> None:
        """Tries to admit the page, for the first time or again. kept: the place that the tab stored."""
        if not self._left:
            self._steps.submit(self._admit, tokens, kept).add_done_callback(print_exception)

    def _admit(self, tokens: Sequence[str], kept: str | None) -> None:
        if self._left:
            return
        private.run_script(self._client, _OWN_TEXT)
        watching, self._page = self._page, None
        if watching is not None:  # the page has only watched so far
            watching.close()
        room = self._room
        guide = room.robot if room is not None and self._teaches else None
        leads = guide is not None
        entered = None
        if guide is None or isinstance(self._sessions, Classroom):
            try:
                entered = self._sessions.enter(tokens, self._refuse, self._account)
            except (OSError, RuntimeError) as error:  # RuntimeError: no thread can be started
                self.tell("There is no robot", why_not(error))
                return
        if watching is not None:
            self._sessions.leave(watching.learner)  # left last, as a classroom counts its pages
        learner = guide or entered
        if learner is None:
            self._turn_away(tokens, kept)
            return
        if room is not None and not leads and not isinstance(learner, Watcher):
            room.recognise(learner.token, tokens, self._account)
            learner.shows_ghosts = isinstance(self._sessions, Classroom)
        if isinstance(self._sessions, Sessions) and not leads and learner.token not in tokens:
            before = place_read(kept, self._sessions.start)
            if before is not None:
                learner.load(before)
                self._client.add_notification(*_GOES_ON, color="green", auto_close_seconds=8.0)
        others = [token for token in tokens if token != learner.token][-7:]
        self._keep(self._tokens_key, json.dumps([*others, learner.token] if learner.token else others))
        watches = isinstance(learner, Watcher)
        visitor = replace(self._visitor, own_files=None) if watches else self._visitor
        self._page = Page(visitor, learner, partial(self._greet, learner, leads))
        self._page.start()

    def _end(self) -> None:
        page, self._page = self._page, None
        if page is not None:
            page.close()
            self._sessions.leave(page.learner)
        if self._room is not None:
            self._room.seats.rise(self._seat)
        self._workers.shutdown(wait=False, cancel_futures=True)

    # ---------------------------------------------------------------- where the page is

    def _watch(self) -> None:
        """Checks every _PERIOD s, on viser's event loop, whether scene or settings have changed. If so, the
        tab stores the page's new place, as the simulation reported it."""
        if self._left or not isinstance(self._sessions, Sessions):
            return
        page = self._page
        if page is not None and page.learner.status is not None:
            new = place_written(page.learner.choice, page.learner.code, self._sessions.start)
            if new != self._stored:
                self._stored = new
                private.run_script(self._client, place_kept(new))
        self._server.get_event_loop().call_later(_PERIOD, self._watch)

    # ---------------------------------------------------------------- calls from the page

    def _keep(self, key: str, text: str) -> None:
        self._client.local_storage.set_item(key, text)

    def _greet(self, learner: SimulationClient, leads: bool, gui: viser.GuiApi) -> None:
        """Adds the field for the instructor's token to a page that can only watch. Adds the card of a class
        to a page of the class."""
        room = self._room
        if room is not None and not leads:
            watches = isinstance(learner, Watcher)
            named = room.state.named
            name = (self._account if named else "") or room.name_of(learner.token)
            asked = named and not watches and not self._account
            call = partial(room.call, learner.token) if asked else None
            card = ClassCard(gui, name, call, partial(room.fetch, learner.token))
            self._seat = f"watcher {id(self)}" if watches else learner.token
            room.seats.sit(self._seat, card.show)
        if isinstance(learner, Watcher):
            add_watching(gui, self._take_token)

    def _take_token(self, token: str) -> bool:
        right = isinstance(self._sessions, Classroom) and self._sessions.is_right(token)
        if right:
            self._then([token])
        return right

    def _refuse(self, sentence: str) -> None:
        self._client.add_notification("Not allowed", sentence, color="orange", auto_close_seconds=4.0)

    def _refuse_upload(self) -> None:
        self._client.add_notification(
            "Not uploaded",
            f"All uploads together may have at most {UPLOADS // 1_000_000} MB: choose a smaller "
            "file, or wait until the other uploads are complete.",
            color="red",
        )

    def tell(self, title: str, sentence: str) -> None:
        """Shows a sentence that stays until the user closes it."""
        self._client.add_notification(title, sentence, color="orange")

    def _turn_away(self, tokens: Sequence[str], kept: str | None) -> None:
        gui, comfort = self._client.gui, self._visitor.comfort
        comfort.set_theme(comfort.dark)
        modal = gui.add_modal("All places are taken")
        with modal:
            gui.add_html(
                block(
                    f"This computer runs a robot for each of {self._sessions.max_sessions} pages, and all "
                    "are in use. Close another tab and try again a few seconds later, or start himpc-lab "
                    "with <code>--max-sessions</code>."
                )
            )
            again = gui.add_button("Try again")
        if self._options.refers:
            loop = self._server.get_event_loop()
            loop.call_soon_threadsafe(loop.call_later, _ELSEWHERE, self._send_on)

        @again.on_click
        async def _(_: object) -> None:
            modal.close()
            self._then(tokens, kept)

    def _send_on(self) -> None:
        """Ends a connection that got no place. The page then connects again by itself."""
        connection = private.connection_of(self._server, self._client)
        if self._page is None and connection is not None:
            connection.transport.abort()
