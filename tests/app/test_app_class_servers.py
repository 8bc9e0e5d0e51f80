"""One class on two servers: the learners of the second server take part in the class of the first one."""

from __future__ import annotations

import asyncio
import json
import math
import socket
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import msgspec
import pytest
from test_app_class import LONG, STEP, Line, teacher
from test_app_class_accounts import upgraded
from test_app_load import get
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.__main__ import main
from app.classes.branch import Branch
from app.classes.gathering import Gathering
from app.classes.link import Link
from app.classes.queue import PATIENCE
from app.classes.relayed import LONGEST, ClassNow, LearnerNow, class_now, of_class, of_server, read_class
from app.classes.views import course, for_all
from app.classes.words import BRANCH, CLASS_KEY
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace, Predict, RunStep
from app.server import server
from app.server.passes import new_token
from app.server.server import PageServer
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec
from robots import InputError

pytestmark = pytest.mark.usefixtures("one_fork_server")
KEY = "the-key-of-the-class"
START = SceneChoice(RunSpec("planar3-hold"))


def leading(port: int = 0) -> PageServer:
    return PageServer(START, port=port, max_sessions=1, class_names=True, class_key=KEY)


@pytest.fixture(scope="module")
def first() -> Iterator[PageServer]:
    running = leading()
    yield running
    running.close()


@pytest.fixture(scope="module")
def second(first: PageServer) -> Iterator[PageServer]:
    running = PageServer(START, port=0, max_sessions=2, class_key=KEY, class_of=first.url)
    yield running
    running.close()


def other_server(server: PageServer, key: str = KEY) -> Line:
    return Line(f"{server.url}/{BRANCH}", **{CLASS_KEY: key})


def test_a_learner_on_another_server_takes_part_from_the_step_to_the_table(
    first: PageServer, second: PageServer
) -> None:
    with teacher(first) as lead, Wire(second.guest_link) as page:
        lead.until("class", "servers", 1)
        assert eventually(lambda: len(second.sessions.learners) == 1, LONG)
        (learner,) = second.sessions.learners
        lead.send(do="set", stays=True, everywhere=True)
        lead.send(do="go", lesson=STEP.lesson, place=STEP.place)
        assert eventually(lambda: learner.choice.exercise == STEP and learner.lecture is not None, LONG)
        assert eventually(lambda: learner.kept_at == STEP, LONG)
        assert eventually(lambda: page.shows("The vote is not open yet"), LONG)

        def named() -> bool:
            asking = [each["uuid"] for each in page.made if "Only your teacher" in str(each)]
            for field in asking[-1:]:  # the page may have been built anew meanwhile, or is being built
                page.write(field, value="Zoë")
            return first.hall is not None and first.hall.name_of(learner.token) == "Zoë"

        assert eventually(named, LONG)

        lead.send(do="press", button="open")
        assert eventually(lambda: page.shows("enter below what you expect"), LONG)
        buttons = page.find("I expect")
        assert buttons is not None
        page.write(buttons, value="B")
        lead.until("all", "voted", 1)
        assert lead.told["all"]["rounds"] == []
        lead.send(do="press", button="close")
        assert eventually(lambda: page.shows("The vote is closed") and page.shows(": 1"), LONG)
        lead.send(do="press", button="run")
        lead.until("all", "stage", "decided")
        assert eventually(lambda: page.shows("The run gave"), LONG)
        while not any(each["done"] for each in lead.hear("class")["class"]["rows"]):
            pass
        (row,) = lead.told["class"]["rows"]
        assert (row["name"], row["vote"], row["done"], row["here"]) == ("Zoë", "B", 1, True)

        lead.send(do="state", number=row["number"])
        assert lead.hear("code")["code"].startswith("hl1-")
        lead.send(do="set", stays=False, everywhere=True)
        assert eventually(lambda: learner.kept_at is None, LONG)
        assert first.hall is not None and first.hall.server_of(learner.token) is not None
    while lead_rows(first)[0]["here"]:
        pass


def lead_rows(server: PageServer) -> list[dict[str, Any]]:
    assert server.hall is not None
    return server.hall.teachers()["rows"]


def test_another_server_that_sends_rubbish_is_sent_away_alone(first: PageServer, second: PageServer) -> None:
    """It gets one answer, a server without the key is refused, and the valid server stays connected."""
    for key in ("", f"{KEY}x"):
        with pytest.raises(InvalidStatus) as refused:
            other_server(first, key)
        assert refused.value.response.status_code == 403
    assert get(f"{first.url}/{BRANCH}", **{CLASS_KEY: KEY})[0] == 403
    join = json.dumps({"do": "join", "server": "s" * 20})
    rubbish: tuple[tuple[str | bytes, ...], ...] = (
        ("x" * (LONGEST + 1),),
        ("[" * 10_000,),
        (b"\xff\xfe",),
        ('{"do":"learners","learners":[]}',),
        (join, join),
        (join, '{"do":"learners","learners":[{"who":"short"}]}'),
    )
    for messages in rubbish:
        with other_server(first) as bad:
            for each in messages:
                bad.socket.send(each)
            with pytest.raises(ConnectionClosed) as ended:
                while True:
                    bad.socket.recv(timeout=LONG)
            assert ended.value.rcvd is not None and ended.value.rcvd.code in (1008, 1009)
    with teacher(first) as lead:
        lead.until("class", "servers", 1)
        assert not any(row["name"] == "" and row["here"] for row in lead.told["class"]["rows"])


def test_steps_that_the_class_does_not_have_are_left_out(first: PageServer) -> None:
    """A lesson that only another server has is not opened; the other learners of that server are added."""
    hall = first.hall
    assert hall is not None
    own, done = (
        ["/etc/passwd", 0],
        [["/etc/passwd", 0, 1, 1], [STEP.lesson, 99, 1, 1], [STEP.lesson, 1, 2, 3]],
    )
    told = [
        *({"who": "w" * 20, "at": own, "done": done}, {"who": "v" * 20, "at": [STEP.lesson, 1000]}),
        {"who": "u" * 20, "at": [STEP.lesson, 1]},
    ]
    with other_server(first) as other:
        other.send(do="join", server="s" * 20)
        other.send(do="learners", learners=told)
        assert eventually(lambda: "u" * 20 in hall.state.members, LONG)
        members = hall.state.members
        places = [members[each["who"]].at for each in told]
        assert places == [None, None, LessonPlace(STEP.lesson, 1)]
        assert members["w" * 20].done == {LessonPlace(STEP.lesson, 1): (2, 3)}


def test_a_lesson_with_a_long_path_is_not_told(first: PageServer) -> None:
    sessions, hall = OneLearner(LessonPlace(f"{'x' * 100}.py")), first.hall
    assert hall is not None
    with following(Branch(sessions), first.url):
        assert eventually(lambda: sessions.one.token in hall.state.members, 20.0)
    assert hall.state.members[sessions.one.token].at is None


def test_a_server_with_another_key_says_what_to_do(
    first: PageServer, capfd: pytest.CaptureFixture[str]
) -> None:
    wrong = PageServer(START, port=0, max_sessions=1, class_key=f"{KEY}x", class_of=first.url)
    said: list[str] = []
    try:
        assert eventually(lambda: said.append(capfd.readouterr().err) or "--class-key" in "".join(said), LONG)
    finally:
        wrong.close()


def test_learners_go_on_without_the_class_and_nothing_is_lost_when_it_is_back() -> None:
    """When the server of the class ends, the learner is informed, may leave the step and runs it. The next
    server at the same address, which has no data yet, receives all of this."""
    lead = leading()
    follower = PageServer(START, port=0, max_sessions=1, class_key=KEY, class_of=lead.url)
    try:
        with Wire(follower.guest_link) as page:
            assert lead.hall is not None
            told = lead.hall
            assert eventually(lambda: len(told.state.members) == 1, LONG)
            (learner,) = follower.sessions.learners
            lead.hall.set(stays=True, everywhere=True)
            lead.hall.go(STEP)
            assert eventually(lambda: learner.kept_at == STEP and learner.lecture is not None, LONG)
            port = int(lead.url.rpartition(":")[2])
            lead.close()
            assert eventually(lambda: page.shows("is interrupted. Continue"), LONG)
            assert learner.kept_at is None
            learner.send(Predict(0))
            learner.send(RunStep())
            assert eventually(lambda: learner.lecture is not None and learner.lecture.phase == "done", LONG)
            lead = leading(port)
            assert lead.hall is not None
            hall = lead.hall
            assert eventually(
                lambda: [row["done"] for row in hall.teachers()["rows"] if row["here"]] == [1], LONG
            )
            assert eventually(lambda: not page.shows("is interrupted"), LONG)
    finally:
        follower.close()
        lead.close()


class NoLearners:
    """The sessions of a server without learners."""

    learners = ()


class OneLearner:
    """The sessions of a server with one learner, whose page is open at a step and who has no robot."""

    def __init__(self, at: LessonPlace | None = None) -> None:
        self.loaded: list[LessonPlace] = []
        self.one: Any = SimpleNamespace(
            token=new_token(),
            attached=True,
            account="",
            choice=SimpleNamespace(exercise=at, at=lambda place: place),
            lecture=None,
            ready=None,
            kept_at=None,
            give_way=lambda: None,
            announce=lambda place: None,
            coming=None,
            load_for_class=self.loaded.append,
        )
        self.learners = (self.one,)


@contextmanager
def following(branch: Branch, at_class: str) -> Iterator[None]:
    """Links a branch to a class until the context ends."""
    loop = asyncio.new_event_loop()
    thread = threading.Thread(target=loop.run_forever)
    thread.start()
    link = Link(branch, at_class, KEY)
    link.start(loop)
    try:
        yield
    finally:
        link.close()
        loop.call_soon_threadsafe(loop.call_later, 0.5, loop.stop)
        thread.join()
        loop.close()


def test_what_a_browser_stores_and_an_unforeseen_error_end_no_link_for_good(
    first: PageServer, capfd: pytest.CaptureFixture[str]
) -> None:
    """A learner's browser brings text that cannot be sent, and then one report fails. The learner is added to
    the class nevertheless."""
    hall, sessions, failures = first.hall, OneLearner(), [RuntimeError()]
    assert hall is not None

    class Failing(Branch):
        def news(self) -> Iterator[bytes]:
            if failures:
                raise failures.pop()
            yield from super().news()

    branch, who, said = Failing(sessions), sessions.one.token, list[str]()
    branch.recognise(who, ["\ud800", "short", "t" * 22, "b" * 101, who])
    with following(branch, first.url):
        assert eventually(lambda: who in hall.state.members, 20.0)
        assert eventually(lambda: said.append(capfd.readouterr().err) or "RuntimeError" in "".join(said), 5.0)


def test_a_second_step_does_not_wait_until_the_first_is_built() -> None:
    """The teacher opens other steps and returns at once. The robot loads each step, also the one that its
    page still shows, and loads the step again when the learner asks for it."""
    there, sessions = LessonPlace(STEP.lesson, 1), OneLearner(STEP)
    branch = Branch(sessions)
    branch.start(lambda: None)
    try:
        state, wanted = Gathering(), list[LessonPlace]()
        for place in (there, LessonPlace(STEP.lesson, 2), STEP, there):
            state, wanted = state.going_to(place), [*wanted, place]
            branch.hear(class_now(state))
            assert eventually(lambda wanted=wanted: sessions.loaded == wanted, PATIENCE / 3)
        branch.fetch(sessions.one.token)
        assert eventually(lambda: sessions.loaded == [*wanted, there], PATIENCE / 3)
    finally:
        branch.close()


def test_the_class_travels_as_numbers_and_is_shown_the_same() -> None:
    """Texts of another server are not shown, and the votes of an open round are not sent."""
    state = Gathering().entered("zoe", "robot", 0.0).going_to(STEP).opened().voted("zoe", 1, 0.0)
    assert class_now(state).rounds == [[]] and "zoe" not in str(class_now(state))
    for each in (state, state.closed(), state.closed().opened().started().measured(0.3)):
        told = of_class.decode(msgspec.json.encode(class_now(each)))
        assert isinstance(told, ClassNow)
        read = read_class(told, course(), {})
        assert {**for_all(read), "voted": 0} == {**for_all(each), "voted": 0}
        assert (read.visits, read.runs) == (each.visits, each.runs)
        assert each is state or read.guess() == each.guess()
    good = class_now(state.closed())
    branch = Branch(NoLearners())
    branch.hear(good)
    for wrong in (
        {"place": (STEP.lesson, 999)},
        {"rounds": [[(77, 1)]]},
        {"rounds": [[(1, 100_000)]]},
        {"rounds": []},
        {"place": None},
    ):
        with pytest.raises(InputError):
            branch.hear(msgspec.structs.replace(good, **wrong))
        assert branch.state.place == STEP, "what cannot be understood changes nothing"
    branch.hear(msgspec.structs.replace(good, place=("mine.py", 0)))
    assert branch.state.place is None, "a file that only another server has"


def test_a_message_about_learners_has_bounds() -> None:
    told = LearnerNow("w" * 20, name="Zoë", done=((STEP.lesson, 0, 2, 3),), answer=1, visit=1)
    good = json.loads(msgspec.json.encode(told))
    assert of_server.decode(json.dumps({"do": "learners", "learners": [good]})).learners == [told]
    for name, value in (
        ("who", "<script>xxxxxxxxxxxxxxx"),
        ("name", "x" * 101),
        ("done", [[STEP.lesson, -1, 0, 0]]),
        ("quiet", -1.0),
        ("answer", "B"),
        ("answer", 1e300),
        ("more", 1),
    ):
        with pytest.raises(msgspec.ValidationError):
            of_server.decode(json.dumps({"do": "learners", "learners": [{**good, name: value}]}))


def test_another_server_changes_its_own_learners_alone(first: PageServer) -> None:
    """A late answer to an earlier question does not count, and learners of other servers are not changed."""
    hall = first.hall
    assert hall is not None
    seat = hall.enter("")
    hall.go(STEP)
    hall.open_vote()
    who, here, there = "w" * 20, "one server of two", "the other one of two"
    hall.link(here)
    hall.link(there)
    old = LearnerNow(who, answer=0, visit=hall.state.visits - 1, at=(STEP.lesson, 0))
    hall.hear(here, old)
    assert hall.mine(who) is None and hall.name_of(who) == ""
    hall.hear(here, msgspec.structs.replace(old, visit=hall.state.visits))
    assert hall.mine(who) == 0
    hall.hear(there, msgspec.structs.replace(old, visit=hall.state.visits, answer=1))
    hall.hear(here, msgspec.structs.replace(old, who=seat, name="a phone"))
    assert hall.mine(who) == 0 and hall.name_of(seat) == ""
    hall.unlink(here)
    assert not hall.state.members[who].here and hall.mine(who) == 0
    hall.hear(there, msgspec.structs.replace(old, name="Max"))
    assert hall.state.members[who].here and hall.name_of(who) == "Max", "its server has gone"
    hall.unlink(there)
    hall.close_vote()


def test_a_learner_who_moves_to_another_server_keeps_one_row(first: PageServer) -> None:
    """The first server still reports the learner. When the learner returns, they have the same row."""
    hall = first.hall
    assert hall is not None
    old, new, here, there = new_token(), new_token(), "one server of two", "the other one of two"
    number = len(hall.state.members)
    hall.link(here)
    hall.link(there)
    hall.hear(here, LearnerNow(old, name="Zoë"))
    hall.hear(here, LearnerNow(old, here=False))
    hall.hear(there, LearnerNow(new, before=(old,)))
    hall.hear(here, LearnerNow(old, here=False, visit=5))
    assert len(hall.state.members) == number + 1 and hall.name_of(new) == "Zoë"
    hall.hear(there, LearnerNow(new, here=False, before=(old,)))
    hall.hear(here, LearnerNow(old, before=(new,)))
    hall.hear(there, LearnerNow(new, here=False, before=(old,), visit=6))
    assert len(hall.state.members) == number + 1 and hall.name_of(old) == "Zoë"
    own = new_token()
    hall.hear(here, LearnerNow(old, here=False))
    hall.recognise(own, [old])
    hall.hear(here, LearnerNow(old, here=False, visit=7))
    assert len(hall.state.members) == number + 1 and hall.name_of(own) == "Zoë"
    hall.unlink(here)
    hall.unlink(there)


def told_by(branch: Branch) -> list[LearnerNow]:
    return [each for message in branch.news() for each in of_server.decode(message).learners]


def test_a_server_tells_of_its_learners_once_it_has_heard_the_class() -> None:
    """It reports each learner once, and again after a change. A learner who has left is not reported again
    when the class goes on; one who returns under another identity keeps their name."""
    sessions = OneLearner()
    branch, old = Branch(sessions), sessions.one.token
    branch.start(lambda: None)
    try:
        branch.recognise(old, ["x" * 22])
        assert eventually(lambda: old in branch.state.members, LONG)
        branch.linked()
        assert told_by(branch) == [], "it does not know yet where the class is"
        state = Gathering().going_to(STEP)
        branch.hear(class_now(state))
        branch.call(old, "Zoë")
        (told,) = told_by(branch)
        assert (told.who, told.before, told.name, told.visit) == (old, ("x" * 22,), "Zoë", 1)
        sessions.one.attached = False
        assert eventually(lambda: not branch.state.members[old].here, LONG)
        assert [each.here for each in told_by(branch)] == [False]
        branch.hear(class_now(state.going_to(STEP)))
        assert told_by(branch) == []
        branch.linked()
        assert told_by(branch) == [], "after an interruption as well"
        branch.hear(class_now(state))
        assert len(told_by(branch)) == 1, "the class may have been started anew"
        sessions.one.token, sessions.one.attached = new_token(), True
        branch.recognise(sessions.one.token, [old])
        (told,) = told_by(branch)
        assert (told.who, told.before, told.name) == (sessions.one.token, (old,), "Zoë")
    finally:
        branch.close()


def test_the_reason_for_which_a_class_ends_a_connection_is_shown(
    first: PageServer, capfd: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    hall, said = first.hall, list[str]()
    assert hall is not None

    def refuse(_: str) -> None:
        raise InputError("a class has \x1b[31mat most 20 other servers")

    monkeypatch.setattr(hall, "link", refuse)
    with following(Branch(OneLearner()), first.url):
        assert eventually(lambda: said.append(capfd.readouterr().err) or "20 other" in "".join(said), LONG)
    text = "".join(said)
    assert "ended the connection: A class has [31mat most 20 other servers; this server tries again" in text
    assert "takes part" not in text


def test_another_server_may_know_the_first_one_by_any_name(first: PageServer) -> None:
    """The key decides. A short host name differs from the one in the example of the documentation."""
    for key, status in ((KEY, 101), (f"{KEY}x", 403)):
        asking = {"Host": "lab-1.example.org:8080", CLASS_KEY: key}
        assert upgraded(first.url, f"/{BRANCH}", **asking) == status
    assert upgraded(first.url, "/v/x", Host="lab-1.example.org:8080") == 403


def test_a_port_that_was_taken_meanwhile_gives_one_sentence(monkeypatch: pytest.MonkeyPatch) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        monkeypatch.setattr(server, "check_address", lambda *_: None)
        with pytest.raises(InputError, match="is in use"):
            PageServer(START, port=taken.getsockname()[1], max_sessions=1)


@pytest.mark.parametrize(
    ("given", "says"),
    [
        (["--class-of", "http://a:1"], "--class-key FILE"),
        (["--class-of", "nonsense", "--class-key"], "--class-of 'nonsense' is not an origin"),
        (["--class", "--class-of", "http://a:1", "--class-key"], "leave out --class"),
        (["--class-key"], "add --class"),
    ],
)
def test_the_command_says_what_does_not_fit(
    given: list[str], says: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "class.txt"
    file.write_text(KEY)
    assert main(["--no-browser", *given, *([str(file)] if given[-1] == "--class-key" else [])]) == 2
    assert says in capsys.readouterr().err


def test_truth_that_is_not_there_is_not_a_number() -> None:
    now = class_now(Gathering().going_to(LessonPlace(STEP.lesson, 1)))
    assert now.truth is None and math.isnan(read_class(now, course(), {}).truth)
    diverged = class_now(Gathering().going_to(STEP).measured(1e13))
    assert diverged.truth is None and of_class.decode(msgspec.json.encode(diverged)) == diverged
