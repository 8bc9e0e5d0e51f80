"""A class on a real server: phones and a teacher that use its protocol, guesses at its code, accounts that a
proxy sends."""

from __future__ import annotations

import csv
import io
import json
import re
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack
from typing import Any
from urllib.parse import quote

import pytest
from served import LONG, get, served
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import ClientConnection, connect

from app.classes.gathering import Gathering
from app.classes.sockets import PER_MINUTE, Newcomers
from app.classes.views import for_teacher
from app.classes.words import LONGEST, ONLY_HERE
from app.client.simulation_client import STAYING, SimulationClient
from app.link.exercise import LessonPlace
from app.web import guard, limits
from app.web.limits import ADDRESSES, FORGET, FREE, MOST_LATE, WrongCodes
from app.web.passes import HEADER, QUERY, USER_HEADER
from app.web.server import PageServer
from app.web.serving import greeting
from browsing.wire import Wire, eventually

STEP = LessonPlace("a-redundant-arm", 0)


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with served(max_sessions=2, class_names=True) as running:
        yield running


class Line:
    """A connection of a page of the class. told: the latest values that the server sent, by name."""

    def __init__(self, address: str, **headers: str) -> None:
        self.socket: ClientConnection = connect(
            address.replace("http", "ws", 1),
            additional_headers=headers,
            max_size=None,
            # The test reads when it needs something. A full queue would hold up the answers to pings.
            max_queue=None,
            ping_interval=None,
            close_timeout=1.0,  # a server that slows a flood down answers late
        )
        self.told: dict[str, Any] = {}

    def __enter__(self) -> Line:
        return self

    def __exit__(self, *_: object) -> None:
        self.socket.close()

    def send(self, **message: Any) -> None:
        self.socket.send(json.dumps(message))

    def hear(self, *names: str) -> dict[str, Any]:
        """Waits for a message that contains one of the names."""
        while True:
            told = json.loads(self.socket.recv(timeout=LONG))
            self.told |= told
            if any(name in told for name in names):
                return told

    def until(self, name: str, key: str, value: object) -> dict[str, Any]:
        """Waits until this key of the part `name` has this value, and returns the part."""
        while self.told.get(name, {}).get(key) != value:
            self.hear(name)
        return self.told[name]


def phone(server: PageServer) -> Line:
    assert server.hall is not None
    line = Line(f"{server.url}/v/{server.hall.code}")
    line.send(do="hello")
    line.hear("seat")
    return line


def teacher(server: PageServer) -> Line:
    line = Line(server.teachers_link)
    line.hear("course")
    return line


def new_learners(server: PageServer, earlier: Sequence[SimulationClient]) -> list[SimulationClient]:
    return [each for each in server.sessions.learners if each.attached and each not in earlier]


def test_the_address_decides_who_is_the_teacher(server: PageServer) -> None:
    """The owner's secret opens the teacher's page and is then stored in a cookie; the guests' token and the
    code of the class do not open this page. The code opens only the phones' page."""
    assert server.hall is not None
    code = server.hall.code
    status, headers, text = get(f"{server.url}/v/{code}")
    assert status == 200 and "Vote" in text and "set-cookie" not in map(str.lower, headers)
    policy = headers["Content-Security-Policy"]
    assert "default-src 'none'" in policy and "frame-ancestors 'none'" in policy and "unsafe" not in policy
    assert headers["X-Frame-Options"] == "DENY" and not re.search(r"""(src|href)=["'](https?:)?//""", text)
    for path in ("/v/", "/v/xxxxxx", f"/v/{code}/", "/class", "/class.csv", f"/class?{QUERY}={code}"):
        assert get(f"{server.url}{path}")[0] == 403, path
    assert get(f"{server.url}/?{QUERY}={code}")[0] == 403, "the code admits nobody to the robots"
    guests = server.guest_link.replace("/?", "/class?")
    cookie = cookie_of(guests)
    assert get(f"{server.url}/class", Cookie=cookie)[0] == 403
    cookie = cookie_of(server.teachers_link)
    status, _, text = get(f"{server.url}/class", Cookie=cookie)
    assert status == 200 and "Open the vote" in text
    for address, more in (
        (f"{server.url}/class", {}),
        (guests, {}),
        (f"{server.url}/v/other1", {}),
        (f"{server.url}/v/{code}", {"Origin": "http://evil.example"}),
    ):
        with pytest.raises(InvalidStatus) as refused:
            Line(address, **more)
        assert refused.value.response.status_code == 403


def cookie_of(link: str, **headers: str) -> str:
    """Returns the cookie that a link sets before it redirects to its page without the secret."""
    answer = get(link, **headers)
    assert (answer.status, answer.headers["Location"]) == (303, "./class")
    return str(answer.headers["Set-Cookie"]).partition(";")[0]


def test_a_lecture_from_the_step_to_who_was_right(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The teacher leads a learner with a robot and two phones through a step with two votes and its run. A
    name that is typed before the class has looked at the page is stored."""
    hall = server.hall
    assert hall is not None
    monkeypatch.setattr(hall, "_look", lambda: None)
    with teacher(server) as lead, Wire(server.guest_link) as page, phone(server) as one, phone(server) as two:
        lead.send(do="here", address="http://lab.example:8080/prefix/")
        shown = lead.hear("address")["address"]
        assert shown["text"] == f"http://lab.example:8080/prefix/v/{hall.code}" and "<svg" in shown["qr"]
        assert eventually(lambda: bool(server.sessions.learners), 60.0)
        learner = server.sessions.learners[0]
        page.use("Your name", "Zoë")
        assert eventually(lambda: hall.name_of(learner.token) == "Zoë", LONG), page.notices
        monkeypatch.undo()
        lead.send(do="go", lesson=STEP.lesson, place=STEP.place)
        assert eventually(lambda: learner.choice.exercise == STEP and learner.lecture is not None, LONG)
        assert eventually(lambda: page.shows("The vote is not open yet"), LONG)
        one.send(do="vote", answer=0)
        assert "No vote is open" in one.hear("say")["say"]

        lead.send(do="press", button="open")
        one.until("all", "stage", "open")
        one.send(do="vote", answer=0)
        assert one.hear("mine")["mine"] == 0
        one.send(do="vote", answer=1)
        assert one.hear("mine")["mine"] == 1, "a second vote replaces the first"
        two.send(do="vote", answer="B")
        assert "does not understand" in two.hear("say")["say"]
        two.send(do="vote", answer=77)
        assert "choose one of" in two.hear("say")["say"]
        assert eventually(lambda: page.begins("A   ") is not None, LONG)
        option = page.begins("A   ")
        assert option is not None
        page.write(option, value=True)
        lead.until("all", "voted", 2)
        assert lead.told["all"]["rounds"] == []

        lead.send(do="press", button="close")
        two.until("all", "stage", "closed")
        two.send(do="vote", answer=0)
        assert "was not counted" in two.hear("say")["say"]
        (bars,) = two.told["all"]["rounds"]
        assert [bar["count"] for bar in bars][:2] == [1, 1]
        assert eventually(lambda: page.shows("The vote is closed"), LONG)

        lead.send(do="press", button="open")
        two.until("all", "round", 2)
        two.send(do="vote", answer=0)
        assert two.hear("mine")["mine"] == 0
        lead.until("all", "voted", 2)  # the learner's prediction still counts
        lead.send(do="press", button="run")
        told = two.until("all", "stage", "decided")
        assert told["result"].startswith("The run gave ") and "In the first vote:" in told["result"]
        assert sum(bar["right"] for bar in told["rounds"][-1]) == 1
        assert two.told["pose"]["joints"] and told["robot"]["capsules"]
        assert eventually(lambda: learner.lecture is not None and learner.lecture.phase == "done", LONG)
        while not lead.hear("class")["class"]["rows"][0]["done"]:
            pass
        (row,) = lead.told["class"]["rows"]
        assert (row["name"], row["vote"], row["done"], row["met"] > 0) == ("Zoë", "A", 1, True)
        assert lead.told["class"]["phones"] == 2

        lead.send(do="state", number=row["number"])
        assert lead.hear("code")["code"].startswith("hl1-")
        lead.send(do="state", number=9999)
        assert "has left" in lead.hear("say")["say"]
    status, headers, text = get(f"{server.url}/class.csv", Cookie=cookie_of(server.teachers_link))
    assert status == 200 and "attachment" in headers["Content-Disposition"]
    rows = [row for row in csv.DictReader(io.StringIO(text)) if row["lesson"]]
    assert sorted((row["name"], row["first vote"], row["second vote"]) for row in rows) == [
        ("", "", "A"),
        ("", "B", ""),
        ("Zoë", "A", "A"),
    ]


def test_learners_stay_or_go_ahead_as_the_teacher_sets(server: PageServer) -> None:
    hall = server.hall
    assert hall is not None
    earlier = server.sessions.learners  # their pages were closed, which the server may not have seen yet
    with teacher(server) as lead, Wire(server.guest_link) as page:
        assert eventually(lambda: len(new_learners(server, earlier)) == 1, LONG)
        (learner,) = new_learners(server, earlier)
        lead.send(do="go", lesson=STEP.lesson, place=1)
        there = LessonPlace(STEP.lesson, 1)
        assert eventually(lambda: learner.choice.exercise == there and learner.lecture is not None, LONG)
        lead.send(do="press", button="run")

        def over() -> bool:
            lecture = learner.lecture
            return lecture is not None and (lecture.exercise, lecture.phase) == (there, "done")

        assert eventually(over, LONG), "a step that follows in the same lesson runs on all pages"
        lead.send(do="set", stays=True, everywhere=False)
        lead.until("class", "stays", True)
        learner.load(learner.choice.at(STEP))
        assert eventually(lambda: any(body == STAYING for _, body in list(page.notices)), LONG)
        assert learner.choice.exercise == there
        lead.send(do="set", stays=False, everywhere=True)
        lead.until("class", "stays", False)
        learner.load(learner.choice.at(STEP))
        assert eventually(lambda: learner.choice.exercise == STEP, LONG)
        assert eventually(lambda: page.find("Go to the class's step") is not None, LONG)
        hall.fetch(learner.token)
        assert eventually(lambda: learner.choice.exercise == there, LONG)


def test_what_a_stranger_sends_ends_their_page_alone(server: PageServer) -> None:
    """Megabytes close the connection, nonsense gets one answer, and a flood does not stop another phone."""
    with phone(server) as good:
        with phone(server) as bad:
            bad.socket.send("x" * 1_000_000)
            with pytest.raises(ConnectionClosed) as ended:
                while True:
                    bad.socket.recv(timeout=LONG)
            assert ended.value.rcvd is not None and ended.value.rcvd.code == 1009
        with phone(server) as bad:
            for each in (
                "",
                "[" * LONGEST,
                '{"do":"vote"}',
                '{"do":"press","button":"open"}',
                "\ud7ff",
                b"\xff\xfe",
            ):
                bad.socket.send(each)
                assert "does not understand" in bad.hear("say")["say"]
        with phone(server) as bad:
            for _ in range(3000):
                try:
                    bad.socket.send('{"do":"vote","answer":0}')
                except ConnectionClosed:
                    break
            for _ in range(3):
                good.send(do="vote", answer=0)
                assert good.hear("say")["say"]


def test_a_phone_that_comes_back_has_its_seat(server: PageServer) -> None:
    assert server.hall is not None
    with phone(server) as one:
        seat = one.told["seat"]
    with Line(f"{server.url}/v/{server.hall.code}") as again:
        again.send(do="vote", answer=0)
        assert "does not understand" in again.hear("say")["say"], "it has not said hello"
        again.send(do="hello", seat=seat)
        assert again.hear("seat")["seat"] == seat
    with Line(f"{server.url}/v/{server.hall.code}") as other:
        other.send(do="hello", seat="one that nobody has")
        assert other.hear("seat")["seat"] not in ("one that nobody has", seat)


def test_a_connection_has_one_seat_and_one_vote(server: PageServer) -> None:
    """A phone that says hello again keeps its seat, with any seat that it names; it counts once and votes
    once, and nobody of it stays when it has gone."""
    hall = server.hall
    assert hall is not None
    assert eventually(lambda: hall.teachers()["phones"] == 0, LONG)
    hall.go(STEP)
    hall.open_vote()
    with phone(server) as one:
        seat = one.told["seat"]
        for named in ("", "one that nobody has", "", seat):
            one.send(do="hello", seat=named)
            assert one.hear("seat")["seat"] == seat
            one.send(do="vote", answer=1)
            assert one.hear("mine")["mine"] == 1
        assert hall.teachers()["phones"] == 1
        assert hall.everybody()["voted"] == 1
    assert eventually(lambda: hall.teachers()["phones"] == 0, LONG)
    hall.close_vote()


def test_a_whole_lecture_hall_behind_one_address_joins_at_once(server: PageServer) -> None:
    with ExitStack() as leaving:
        for _ in range(200):
            leaving.enter_context(phone(server))
        assert server.hall is not None and server.hall.teachers()["phones"] == 200


def test_a_flood_of_new_phones_from_one_address_waits(
    server: PageServer, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It keeps out neither a phone that has a seat nor, in the next minute, a new one."""
    assert server.hall is not None
    with phone(server) as one:
        seat = one.told["seat"]
    monkeypatch.setattr("app.classes.sockets.PER_MINUTE", 0)
    with Line(f"{server.url}/v/{server.hall.code}") as new, Line(f"{server.url}/v/{server.hall.code}") as old:
        new.send(do="hello")
        told = new.hear("say")
        assert "joins by itself" in told["say"] and told["wait"] > 0 and "seat" not in told
        old.send(do="hello", seat=seat)
        assert old.hear("seat")["seat"] == seat
        monkeypatch.undo()
        new.send(do="hello")
        new.hear("seat")


def test_new_phones_are_counted_by_address_and_minute() -> None:
    now = [0.0]
    newcomers = Newcomers(lambda: now[0])
    assert [newcomers.admit("a") for _ in range(PER_MINUTE + 1)] == [True] * PER_MINUTE + [False]
    assert newcomers.admit("b") and newcomers.admit(None)
    now[0] = 60.0
    assert newcomers.admit("a")


def test_an_address_that_phones_cannot_reach_is_said(server: PageServer) -> None:
    """This server listens on 127.0.0.1. Terminal and teacher's page say so next to the phones' address."""
    assert any(ONLY_HERE in line for line in greeting(server))
    with Line(server.teachers_link) as lead:
        lead.hear("address")
        assert "127.0.0.1" in lead.told["address"]["text"] and lead.told["address"]["note"] == ONLY_HERE
        lead.send(do="here", address="http://lab.example:8080")
        assert lead.hear("address")["address"]["note"] == ""


def test_a_server_without_a_class_has_none_of_its_pages() -> None:
    with served() as server:
        assert get(f"{server.url}/class")[0] == get(f"{server.url}/v/abcdef")[0] == 403


# ---------------------------------------------------------------- guesses at the code


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
        assert eventually(lambda: get(right)[0] == 200, LONG)
    assert "wrong codes" not in capfd.readouterr().err


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


# ---------------------------------------------------------------- accounts that a proxy sends

TOKEN, ORIGIN = "the-token-of-the-proxy", "https://lab.example.org"


@pytest.fixture(scope="module")
def behind() -> Iterator[PageServer]:
    named = {"token": TOKEN, "class_names": True, "proxy_only": True, "trusted_origins": [ORIGIN]}
    with served(max_sessions=2, **named) as running:
        yield running


def by_proxy(account: str = "") -> dict[str, str]:
    return {HEADER: TOKEN, USER_HEADER: quote(account)}


def test_only_the_proxy_opens_the_pages_of_the_class(behind: PageServer) -> None:
    """Without the proxy, neither the code of the class nor the teacher's secret opens a page."""
    assert behind.hall is not None
    phones, secret = f"{behind.url}/v/{behind.hall.code}", f"?{QUERY}={behind.passes.owner}"
    for path in ("/v/xxxxxx", "/class", f"/class{secret}", "/class.csv", "/", f"/v/{behind.hall.code}"):
        assert get(f"{behind.url}{path}")[0] == 403, path
        assert get(f"{behind.url}{path}", **{HEADER: f"{TOKEN}x"})[0] == 403, path
    for path in (phones, f"{behind.url}/class{secret}"):
        with pytest.raises(InvalidStatus):
            Line(path)
    assert get(phones, **by_proxy())[0] == 200
    assert get(f"{behind.url}/class", **by_proxy("zoe"))[0] == 403, "a learner is not the teacher"
    assert behind.teachers_link == f"{ORIGIN}/class{secret}"
    cookie = cookie_of(f"{behind.url}/class{secret}", **by_proxy("prof"))
    assert get(f"{behind.url}/class", Cookie=cookie)[0] == 403
    assert get(f"{behind.url}/class", Cookie=cookie, **by_proxy("prof"))[0] == 200
    assert TOKEN not in "".join(greeting(behind))


def test_the_account_is_the_name_of_the_row(behind: PageServer) -> None:
    """The page does not ask for a name, the name cannot be changed, and the learner's robot is given to
    nobody else."""
    hall = behind.hall
    assert hall is not None
    lead = Line(f"{behind.url}/class?{QUERY}={behind.passes.owner}", **by_proxy("prof"))
    with lead, Wire(behind.url, by_proxy("zoë")) as page:
        while not lead.hear("class")["class"]["rows"]:
            pass
        (row,) = lead.told["class"]["rows"]
        assert row["name"] == "zoë"
        assert eventually(lambda: page.shows("Your teacher sees your account, <b>zoë</b>"), LONG)
        assert not any("Only your teacher" in str(each) for each in page.made), "it asks for no name"
        (learner,) = behind.sessions.learners
        hall.call(learner.token, "somebody else")
        assert hall.name_of(learner.token) == "zoë"
    assert eventually(lambda: not learner.attached, LONG)
    enter = behind.sessions.enter
    other = enter([learner.token], print, "max")
    assert other is not None and other is not learner
    assert enter([learner.token], print, "zoë") is learner


def test_an_account_keeps_its_row_and_names_may_be_left_out() -> None:
    """Another browser with the same account continues in the same row. A class without names stores no
    account."""
    begun = Gathering().entered("one", "robot", 0.0, "zoe").entered("two", "robot", 0.0, "max")
    left = begun.going_to(STEP).opened().voted("one", 0, 1.0).left("one")
    assert left.succeeded("new", ["one"], "max") == left, "a browser that both used proves nothing"
    again = left.succeeded("new", [], "zoe").entered("new", "robot", 2.0, "zoe")
    assert [(each.number, each.name) for each in again.members.values()] == [(1, "zoe"), (2, "max")]
    assert again.poll is not None and again.poll.latest == {"new": 0}
    nameless = Gathering(named=False).entered("one", "robot", 0.0, "zoe")
    assert "zoe" not in repr(nameless) and for_teacher(nameless, 0.0)["rows"][0]["name"] == ""
