"""Measures the cost of a lecture hall: phones vote and watch the teacher's robot.

    python -m benchmarks.phones [--phones 200] [--scene S] [--seconds S]

The program starts a server with a class and, in a process of their own, phones that use the page's protocol
and draw nothing. The teacher's robot moves all the time, so that each phone gets five pictures a second. Then
all phones vote at the same time. They vote twice. The program prints JSON. The exit code is 0 if the server,
without the robot's own process, needs at most one core and every vote was counted.
"""

from __future__ import annotations

import asyncio
import json
import sys
import time
from math import sqrt
from statistics import quantiles
from typing import Any

import psutil
import tyro
from websockets.asyncio.client import ClientConnection, connect

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.link.process import wait_until
from app.web.server import PageServer
from benchmarks.child import LONG, Child, tell
from lessons.scenes.run_spec import RunSpec

STEP = LessonPlace("a-redundant-arm", 0)


def main(
    phones: int = 200, scene: str = "iiwa14-circle", seconds: float = 20.0, at: str | None = None
) -> int:
    """Does what the module says."""
    if at is not None:
        asyncio.run(be_phones(at, phones))
        return 0
    server = PageServer(SceneChoice(RunSpec(scene)), port=0, max_sessions=1, classroom=True, class_names=True)
    try:
        found = measured(server, phones, seconds)
    finally:
        server.close()
    print(json.dumps(found, indent=1))
    return 0 if found["server_share"] <= 1.0 and found["counted"] == [phones] * 2 else 1


# ------------------------------------------------------------------ the phones


async def be_phones(address: str, count: int) -> None:
    """Connects all phones. The first line on stdin begins the counting of pictures, and the second ends it.
    Each further line lets all phones vote, after which a line with the measured times is printed."""
    phones = await asyncio.gather(*(Phone.open(address, k) for k in range(count)))
    tell(phones=len(phones))
    await _line()
    before, began = [phone.poses for phone in phones], time.monotonic()
    await _line()
    spent = time.monotonic() - began
    rates = [(phone.poses - then) / spent for phone, then in zip(phones, before, strict=True)]
    size = sum(phone.bytes for phone in phones) / count / spent
    tell(
        slowest_hz=round(min(rates), 2),
        fastest_hz=round(max(rates), 2),
        kilobytes_per_s=round(1e-3 * size, 2),
    )
    while await _line():
        waits = await asyncio.gather(*(phone.vote() for phone in phones))
        tell(median_ms=round(1e3 * quantiles(waits)[1]), longest_ms=round(1e3 * max(waits)))


class Phone:
    """A phone. poses, bytes: what it has received so far."""

    def __init__(self, line: ClientConnection, number: int) -> None:
        self._line, self._number = line, number
        self.poses = self.bytes = 0
        self._asked: dict[str, Any] = {}
        self._answer: asyncio.Future[None] | None = None
        self._reader = asyncio.ensure_future(self._read())

    @classmethod
    async def open(cls, address: str, number: int) -> Phone:
        """Returns a phone that has sent its first message."""
        await asyncio.sleep(0.01 * number)
        line = await connect(address, max_size=None, open_timeout=LONG, ping_interval=None)
        await line.send('{"do":"hello"}')
        await line.recv()
        return cls(line, number)

    async def _read(self) -> None:
        async for text in self._line:
            self.bytes += len(text)
            told = json.loads(text)
            self.poses += "pose" in told
            self._asked = told.get("all", {}).get("asked") or self._asked
            if "say" in told and self._answer is not None and not self._answer.done():
                self._answer.set_result(None)

    async def vote(self) -> float:
        """Votes. Returns the time until the answer, s."""
        self._answer = asyncio.get_running_loop().create_future()
        began = time.monotonic()
        options, scale = self._asked.get("options"), self._asked.get("scale")
        answer = self._number % len(options or (0,)) if scale is None else sqrt(scale["low"] * scale["high"])
        await self._line.send(json.dumps({"do": "vote", "answer": answer}))
        await self._answer
        return time.monotonic() - began


async def _line() -> bool:
    return bool(await asyncio.to_thread(sys.stdin.readline))


# ------------------------------------------------------------------ the server


def crowd(address: str, count: int) -> Child:
    """Returns phones in a process of their own that have joined a class."""
    phones = Child("benchmarks.phones", "--phones", str(count), "--at", address)
    assert phones.hear("phones")["phones"] == count
    return phones


def measured(server: PageServer, count: int, seconds: float) -> dict[str, Any]:
    """Returns the server's share of a core while all phones watch, and the time for which they wait for their
    votes."""
    hall = server.hall
    assert hall is not None
    address = f"{server.url.replace('http', 'ws')}/v/{hall.code}"
    with crowd(address, count) as phones:
        assert wait_until(lambda: (hall.pose() or {"t": 0.0})["t"] > 0.5, LONG), "the robot does not move"
        alone = psutil.Process(phones.pid)
        phones.say()
        busy, theirs, began = time.process_time(), sum(alone.cpu_times()[:2]), time.perf_counter()
        time.sleep(seconds)
        spent = time.perf_counter() - began
        share, shares = (time.process_time() - busy) / spent, (sum(alone.cpu_times()[:2]) - theirs) / spent
        phones.say()
        watched = phones.hear("slowest_hz")
        hall.go(STEP)
        assert wait_until(lambda: hall.robot.choice.exercise == STEP, LONG), "the step is not loaded"
        counted, waits = [], []
        for _ in range(2):
            hall.open_vote()
            time.sleep(1.0)  # wait until all phones have received this
            phones.say()
            waits.append(phones.hear("longest_ms"))
            hall.close_vote()
            poll = hall.state.poll
            counted.append(0 if poll is None else len(poll.latest))
    return {
        "phones": count,
        "cores": psutil.cpu_count(),
        "server_share": round(share, 3),
        "phones_share": round(shares, 3),
        **watched,
        "votes": waits,
        "counted": counted,
        "load_average": round(psutil.getloadavg()[0], 1),
    }


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
