"""The connection of a server to the class that it follows. The code runs on the server's loop."""

from __future__ import annotations

import asyncio
import random
import sys
from contextlib import suppress
from http import HTTPStatus

import msgspec
from websockets.asyncio.client import ClientConnection, connect
from websockets.exceptions import ConnectionClosed, InvalidStatus, WebSocketException

from app.classes.branch import Branch
from app.classes.relayed import LONGEST, AskState, ClassNow, Join, StateTold, of_class
from app.classes.words import BRANCH, CLASS_KEY
from robots import InputError

FIRST, LAST = 1.0, 15.0
"""Time, s, until the first new attempt to connect, and the longest time between two attempts."""
PERIOD = 0.2
"""Time, s, between two messages that this server sends. A quarter of this time is the shortest time
between two messages that this server reads."""
_AGAIN = "this server tries again, and its learners can continue"
_REFUSED = (
    f"the class's server refuses this server: start the class's server with --class, and both servers with "
    f"the same --class-key FILE; {_AGAIN}"
)
_QUESTIONS = 4  # largest number of requests that are answered at the same time


class _Direct(connect):
    """A connection that follows no redirect. After a redirect another server would get the key."""

    def process_redirect(self, exc: Exception) -> Exception | str:
        return exc


class Link:
    """Connects to the class, tries again after a failure, and passes on the messages of both sides."""

    def __init__(self, branch: Branch, address: str, key: str) -> None:
        """address: the address of the class's server, as `as_origin` returns it; key: the key of the
        class."""
        self._branch = branch
        self._address = f"{address.replace('http', 'ws', 1)}/{BRANCH}"
        self._key = key
        self._task: asyncio.Task[None] | None = None
        self._asked: set[asyncio.Task[None]] = set()
        self._reported = ""
        self._pause = FIRST

    def start(self, loop: asyncio.AbstractEventLoop) -> None:
        """Begins to connect, on the server's loop."""
        self._branch.start(lambda: None)

        async def begin() -> None:
            self._task = asyncio.ensure_future(self._stay())

        asyncio.run_coroutine_threadsafe(begin(), loop)

    def close(self) -> None:
        """Ends the connection and the branch."""
        task = self._task
        if task is not None:
            with suppress(RuntimeError):  # raised if the loop has ended
                task.get_loop().call_soon_threadsafe(task.cancel)
        self._branch.close()

    async def _stay(self) -> None:
        while True:
            try:
                async with self._connection() as line:
                    await self._talk(line)
            except InvalidStatus as error:
                known = error.response.status_code != HTTPStatus.FORBIDDEN
                self._report(f"{self._address} cannot be reached; {_AGAIN}" if known else _REFUSED)
            except ConnectionClosed as error:
                reason = _plain("" if error.rcvd is None else error.rcvd.reason)
                ended = f"ended the connection: {reason}" if reason else "cannot be reached"
                self._report(f"{self._address} {ended}; {_AGAIN}")
            except (OSError, TimeoutError, WebSocketException, InputError):
                self._report(f"{self._address} cannot be reached; {_AGAIN}")
            except Exception as error:  # without the link, the class would get no data of this server
                self._report(f"the link to {self._address} failed ({type(error).__name__}); {_AGAIN}")
            finally:
                self._branch.cut_off()
            await asyncio.sleep(self._pause * random.uniform(0.5, 1.0))
            self._pause = min(LAST, 2 * self._pause)

    def _report(self, sentence: str) -> None:
        """Prints the state of the connection on the terminal whenever it changes."""
        if sentence != self._reported:
            self._reported = sentence
            print(f"himpc-lab: {sentence}", file=sys.stderr, flush=True)

    def _connection(self) -> connect:
        return _Direct(
            self._address,
            additional_headers={CLASS_KEY: self._key},
            max_size=LONGEST,
            max_queue=4,
            proxy=None,
            open_timeout=LAST,
            close_timeout=1.0,
            user_agent_header=None,
        )

    async def _talk(self, line: ClientConnection) -> None:
        """Sends and receives until the connection ends. Then raises an error."""
        await line.send(msgspec.json.encode(Join(self._branch.server)), text=True)
        self._branch.linked()
        both = [asyncio.ensure_future(each) for each in (self._tell(line), self._hear(line))]
        try:
            done, _ = await asyncio.wait(both, return_when=asyncio.FIRST_COMPLETED)
            for each in done:
                each.result()
        finally:
            for each in (*both, *self._asked):
                each.cancel()
            await asyncio.gather(*both, return_exceptions=True)

    async def _tell(self, line: ClientConnection) -> None:
        while True:
            for message in self._branch.news():
                await line.send(message, text=True)
                await asyncio.sleep(PERIOD)
            await asyncio.sleep(PERIOD)

    async def _hear(self, line: ClientConnection) -> None:
        while True:
            try:
                told = of_class.decode(await line.recv())
            except (msgspec.MsgspecError, UnicodeError, RecursionError):
                raise InputError("the class's server sent a message that is not valid") from None
            match told:
                case ClassNow():
                    await asyncio.to_thread(self._branch.hear, told)
                    self._pause = FIRST
                    self._report(f"this server takes part in the class of {self._address}")
                case AskState(who) if len(self._asked) < _QUESTIONS:
                    answer = asyncio.ensure_future(self._answer(line, who))
                    self._asked.add(answer)
                    answer.add_done_callback(self._asked.discard)
                case AskState():
                    pass
            await asyncio.sleep(PERIOD / 4)

    async def _answer(self, line: ClientConnection, who: str) -> None:
        code = await asyncio.to_thread(self._branch.code_of, who)
        with suppress(WebSocketException):
            await line.send(msgspec.json.encode(StateTold(who, code)), text=True)


def _plain(reason: str) -> str:
    """Returns the printable characters of a reason, without the final full stop."""
    return "".join(each for each in reason if each.isprintable()).strip().rstrip(".")
