"""The two pages of a class, the teacher's and the phones', and their connections. The pages use no library,
load no other files, and run only their own script. This code runs on the server's loop."""

from __future__ import annotations

import asyncio
import base64
import hashlib
import io
import json
import time
from collections.abc import Callable
from functools import cache, lru_cache
from importlib.resources import files
from typing import Any, Literal, Protocol

import msgspec
import segno
from websockets.asyncio.server import broadcast
from websockets.exceptions import ConnectionClosed

from app.classes.hall import Hall
from app.classes.views import View
from app.classes.words import (
    ONLY_HERE,
    CastVote,
    GoTo,
    Hello,
    Here,
    OfTeacher,
    OpenState,
    Press,
    SetClass,
    TypedName,
    of_phone,
    of_teacher,
)
from robots import InputError

PageName = Literal["phone", "teacher"]


@cache
def page(name: PageName) -> str:
    return _file(f"{name}.html").replace("/*style*/", _style(name)).replace("/*script*/", _script(name))


def policy(name: PageName, host: str) -> str:
    """Returns the page's Content-Security-Policy. host: the server's name in the browser's request, for
    browsers in which 'self' does not include web sockets."""
    return (
        f"default-src 'none'; script-src '{_digest(_script(name))}'; style-src '{_digest(_style(name))}'; "
        f"connect-src 'self' ws://{host} wss://{host}; frame-ancestors 'none'; base-uri 'none'; "
        "form-action 'none'"
    )


@lru_cache(maxsize=16)
def qr(address: str) -> str:
    drawn = io.BytesIO()
    segno.make(address, error="m").save(
        drawn, kind="svg", xmldecl=False, svgns=True, omitsize=True, border=2, light="#fff"
    )
    return drawn.getvalue().decode()


def _style(name: PageName) -> str:
    return _file("class.css") + _file(f"{name}.css")


def _script(name: PageName) -> str:
    return "".join(_file(each) for each in ("robot.js", "class.js", f"{name}.js"))


def _digest(text: str) -> str:
    return f"sha256-{base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()}"


@cache
def _file(name: str) -> str:
    return (files("app.classes") / "web" / name).read_text(encoding="utf-8")


PER_MINUTE = 400
"""Largest number of new phones from one address in a minute: a whole lecture hall may be behind one
address."""
ADDRESSES = 1000
"""Largest number of addresses that are remembered; those that have been silent longest are forgotten."""


class Newcomers:
    """Counts the phones that join, by address. An unknown address (behind a proxy) counts as one address."""

    def __init__(self, clock: Callable[[], float] = time.monotonic) -> None:
        """clock: returns the time, s."""
        self._clock = clock
        self._joined: dict[str | None, tuple[float, int]] = {}  # begin of the minute, and the number since

    def admit(self, address: str | None) -> bool:
        """Counts one more phone; returns whether it may join now."""
        now = self._clock()
        since, number = self._joined.pop(address, (now, 0))
        if now - since >= 60.0:
            since, number = now, 0
        self._joined[address] = since, min(number + 1, PER_MINUTE + 1)
        if len(self._joined) > ADDRESSES:
            del self._joined[next(iter(self._joined))]
        return number < PER_MINUTE


PAUSE = 0.2
"""Shortest time, s, between two messages that are read from one page."""
_UNSENT = 64_000  # B that may wait for a slow page before pictures are left out
_WAIT = 20.0  # s after which a phone that was not admitted says hello again
_CROWD = "Many phones of your network are joining: this page joins by itself in less than a minute."
_COUNTED = "Your vote is counted. You can change it until the vote is closed."
_NONSENSE = "this page sent something that the class does not understand: reload it"


class Line(Protocol):
    """A connection whose messages are limited in length and number. address: the address of the client; None
    if it is unknown."""

    address: str | None

    async def recv_short(self) -> str | bytes:
        """Returns the next message. Raises ConnectionClosed when the connection has ended."""
        ...

    async def send(self, message: str) -> None: ...


class Sockets:
    """The open pages of a class."""

    def __init__(
        self,
        hall: Hall,
        address: Callable[[], str],
        only_here: bool = False,
        keep: Callable[[], object] = lambda: None,
    ) -> None:
        """address: the address of the server for other machines; only_here: whether only this machine can
        reach that address; keep: saves the class if it has changed, called on the thread of the class."""
        self._hall, self._address, self._only_here, self._keep = hall, address, only_here, keep
        self._phones: dict[Any, str] = {}  # seat by connection
        self._newcomers = Newcomers()
        self._teachers: set[Any] = set()
        self._said: dict[str, str] = {}
        self._behind: set[Any] = set()
        """Pages that were too slow for the last changes. They get all data next time instead of the
        changes."""
        self._loop: asyncio.AbstractEventLoop | None = None

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begins to send poses and changes to all pages."""
        self._loop = loop
        self._hall.start(self._tell)

    def close(self) -> None:
        self._hall.close()

    # ---------------------------------------------------------------- one page

    async def phone(self, line: Line) -> None:
        seat = ""
        try:
            while True:
                try:
                    seat, answer = self._of_phone(line, seat, await line.recv_short())
                except InputError as error:
                    answer = {"say": _sentence(error)}
                await line.send(json.dumps(answer))
                await asyncio.sleep(PAUSE)
        except ConnectionClosed:
            pass
        finally:
            if self._phones.pop(line, None) is not None and seat not in self._phones.values():
                self._hall.leave(seat)

    def _of_phone(self, line: Line, seat: str, raw: str | bytes) -> tuple[str, View]:
        said = _understood(of_phone, raw)
        match said:
            case Hello():
                if not seat:  # a connection has one seat, however often it says hello
                    if not self._hall.knows(said.seat) and not self._newcomers.admit(line.address):
                        return "", {"say": _CROWD, "wait": _WAIT}
                    seat = self._phones[line] = self._hall.enter(said.seat)
                news = {"all": self._hall.everybody(), "seat": seat, "mine": self._hall.mine(seat)}
                return seat, {**news, "pose": self._hall.pose(), "name": self._hall.name_of(seat)}
            case _ if not seat:
                raise InputError(_NONSENSE)
            case CastVote(answer):
                self._hall.vote(seat, answer)
                return seat, {"mine": self._hall.mine(seat), "say": _COUNTED}
            case TypedName(name):
                self._hall.call(seat, name)
                return seat, {"name": self._hall.name_of(seat)}
            case _:
                raise InputError(_NONSENSE)

    async def teacher(self, line: Line) -> None:
        self._teachers.add(line)
        try:
            await line.send(json.dumps(self._greeting()))
            while True:
                try:
                    answer = await self._of_teacher(_understood(of_teacher, await line.recv_short()))
                except InputError as error:
                    answer = {"say": _sentence(error)}
                await line.send(json.dumps({"say": "", **answer, **self._news()}))
        except ConnectionClosed:
            pass
        finally:
            self._teachers.discard(line)

    def _greeting(self) -> View:
        first = self._hall.first
        place = None if first is None else [first.lesson, first.place]
        return {
            "course": self._hall.course, "first": place, "address": self._phones_at(""), **self._news(),
        }  # fmt: skip

    def _news(self) -> View:
        return {"all": self._hall.everybody(), "class": self._hall.teachers(), "pose": self._hall.pose()}

    def _phones_at(self, address: str) -> View:
        whole = f"{(address or self._address()).rstrip('/')}/v/{self._hall.code}"
        return {"text": whole, "qr": qr(whole), "note": ONLY_HERE if self._only_here and not address else ""}

    async def _of_teacher(self, said: OfTeacher) -> View:
        hall = self._hall
        match said:
            case GoTo(lesson, place):
                await asyncio.to_thread(hall.go, hall.place(lesson, place))
            case Press("open"):
                hall.open_vote()
            case Press("close"):
                hall.close_vote()
            case Press("run"):
                await asyncio.to_thread(hall.run)
            case Press("back"):
                await asyncio.to_thread(hall.show_step)
            case Press():
                raise InputError(_NONSENSE)
            case SetClass(stays, everywhere):
                hall.set(stays, everywhere)
            case OpenState(number):
                return {"code": await self._open(number), "of": number}
            case Here(address):
                return {"address": self._phones_at(address)}
        return {}

    async def _open(self, number: int) -> str:
        """Loads the state of a learner into the teacher's robot, and returns the state's code."""
        who = self._hall.who(number)
        code = await asyncio.to_thread(self._hall.code_of, who)
        await asyncio.to_thread(self._hall.show_state, code)
        return code

    # ---------------------------------------------------------------- all pages

    def _tell(self) -> None:
        """Called on the thread of the class after each check of the pages."""
        self._keep()
        news = {name: json.dumps(each) for name, each in self._news().items() if each is not None}
        loop = self._loop
        if loop is not None and not loop.is_closed():
            loop.call_soon_threadsafe(self._spread, news)

    def _spread(self, news: dict[str, str]) -> None:
        changed = {name: text for name, text in news.items() if self._said.get(name) != text}
        self._said = news
        for lines, names in ((self._phones, ("all", "pose")), (self._teachers, ("all", "class", "pose"))):
            slow = {line for line in lines if line.transport.get_write_buffer_size() > _UNSENT}
            again = self._behind.intersection(lines) - slow
            for some, told in ((again, news), (set(lines) - slow - again, changed)):
                text = ",".join(f'"{name}":{told[name]}' for name in names if name in told)
                if text and some:
                    broadcast(some, f"{{{text}}}")
            self._behind = (self._behind - again) | slow
        self._behind &= {*self._phones, *self._teachers}


def _sentence(error: InputError) -> str:
    text = str(error)
    return f"{text[:1].upper()}{text[1:]}."


def _understood(decoder: msgspec.json.Decoder[Any], raw: str | bytes) -> Any:
    try:
        return decoder.decode(raw)
    except (msgspec.MsgspecError, UnicodeError, RecursionError):
        raise InputError(_NONSENSE) from None
