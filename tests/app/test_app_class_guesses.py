"""Guesses at the code of a class."""

from __future__ import annotations

import time
from concurrent.futures import ThreadPoolExecutor

import pytest
from test_app_class import LONG, Line, server
from test_app_load import get

from app.web import guard, limits
from app.web.limits import ADDRESSES, FORGET, FREE, MOST_LATE, WrongCodes
from app.web.server import PageServer

__all__ = ["server"]


def test_guesses_are_said_and_slowed_down_and_do_not_disturb_a_phone(
    server: PageServer, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """After 20 different wrong codes all answers are late, also those to a right code; the terminal says so
    once. A phone that is already there goes on, and one that comes is admitted."""
    monkeypatch.setattr(guard, "DELAY", 0.5)
    assert server.hall is not None
    right = f"{server.url}/v/{server.hall.code}"

    def asked(address: str) -> tuple[int, float]:
        began = time.monotonic()
        return get(address)[0], time.monotonic() - began

    for _ in range(3 * FREE):
        assert get(f"{server.url}/v/xxxxxx")[0] == 403, "the code of an earlier class"
    assert "wrong codes" not in capfd.readouterr().err
    with Line(right) as phone:
        phone.send(do="hello")
        phone.hear("seat")
        for k in range(FREE):
            assert get(f"{server.url}/v/guess{k}")[0] == 403
        said = capfd.readouterr().err
        assert said.count("127.0.0.1 sent more than 20 different wrong codes of the class") == 1
        for address, status in ((f"{server.url}/v/guess", 403), (right, 200)):
            found, seconds = asked(address)
            assert found == status and seconds >= 0.5
        phone.send(do="name", name="Max")
        phone.hear("name")
        with Line(right) as other:
            other.send(do="hello")
            assert other.hear("seat")["seat"] != phone.told["seat"]
        monkeypatch.setattr(limits, "MOST_LATE", 1)
        with ThreadPoolExecutor(8) as many:
            assert 429 in many.map(lambda k: get(f"{server.url}/v/more{k}")[0], range(8))
        assert eventually_200(right)
    assert "wrong codes" not in capfd.readouterr().err


def eventually_200(address: str) -> bool:
    end = time.monotonic() + LONG
    while get(address)[0] != 200:
        assert time.monotonic() < end
    return True


def test_what_is_remembered_has_bounds_and_is_forgotten() -> None:
    now = [0.0]
    wrong = WrongCodes(lambda: now[0])
    for k in range(10 * FREE):
        wrong.note("a", f"{k}" * 9000)
        wrong.note(None, "b")
    assert wrong.are_many("a") and not wrong.are_many(None)
    assert sum(map(len, wrong._guesses["a"].codes)) <= 32 * (FREE + 1)
    now[0] = FORGET + 1.0
    assert not wrong.are_many("a")
    for k in range(2 * ADDRESSES):
        wrong.note(f"{k}", "x")
    assert len(wrong._guesses) == ADDRESSES
    for k in range(FREE + 1):
        wrong.note("c", f"{k}")
    waiting = [wrong.waits("c") for _ in range(MOST_LATE + 1)]
    assert [each.__enter__() for each in waiting] == [True] * MOST_LATE + [False]
