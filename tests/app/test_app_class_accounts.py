"""A class behind a proxy whose visitors have signed in: the account is the name of a learner's row."""

from __future__ import annotations

from collections.abc import Iterator
from urllib.parse import quote

import pytest
from served import served
from test_app_class import LONG, Line, cookie_of
from test_app_load import get
from websockets.exceptions import InvalidStatus

from app.__main__ import main
from app.classes.gathering import Gathering
from app.classes.views import for_teacher
from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.web.passes import HEADER, QUERY, USER_HEADER
from app.web.server import PageServer
from app.web.serving import greeting
from browsing.wire import Wire, eventually
from lessons.scenes.run_spec import RunSpec

START = SceneChoice(RunSpec("planar3-hold"))
TOKEN, ORIGIN = "the-token-of-the-proxy", "https://lab.example.org"


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    named = {"token": TOKEN, "class_names": True, "proxy_only": True, "trusted_origins": [ORIGIN]}
    with served(START, max_sessions=2, **named) as running:
        yield running


def by_proxy(account: str = "") -> dict[str, str]:
    return {HEADER: TOKEN, USER_HEADER: quote(account)}


def test_only_the_proxy_opens_the_pages_of_the_class(server: PageServer) -> None:
    """Without the proxy, neither the code of the class nor the teacher's secret opens a page."""
    assert server.hall is not None
    phones, secret = f"{server.url}/v/{server.hall.code}", f"?{QUERY}={server.passes.owner}"
    for path in ("/v/xxxxxx", "/class", f"/class{secret}", "/class.csv", "/", f"/v/{server.hall.code}"):
        assert get(f"{server.url}{path}")[0] == 403, path
        assert get(f"{server.url}{path}", **{HEADER: f"{TOKEN}x"})[0] == 403, path
    for path in (phones, f"{server.url}/class{secret}"):
        with pytest.raises(InvalidStatus):
            Line(path)
    assert get(phones, **by_proxy())[0] == 200
    assert get(f"{server.url}/class", **by_proxy("zoe"))[0] == 403, "a learner is not the teacher"
    assert server.teachers_link == f"{ORIGIN}/class{secret}"
    cookie = cookie_of(f"{server.url}/class{secret}", **by_proxy("prof"))
    assert get(f"{server.url}/class", Cookie=cookie)[0] == 403
    assert get(f"{server.url}/class", Cookie=cookie, **by_proxy("prof"))[0] == 200
    assert TOKEN not in "".join(greeting(server))


def test_the_account_is_the_name_of_the_row(server: PageServer) -> None:
    """The page does not ask for a name, the name cannot be changed, and the learner's robot is given to
    nobody else."""
    hall = server.hall
    assert hall is not None
    lead = Line(f"{server.url}/class?{QUERY}={server.passes.owner}", **by_proxy("prof"))
    with lead, Wire(server.url, by_proxy("zoë")) as page:
        while not lead.hear("class")["class"]["rows"]:
            pass
        (row,) = lead.told["class"]["rows"]
        assert row["name"] == "zoë"
        assert eventually(lambda: page.shows("Your teacher sees your account, <b>zoë</b>"), LONG)
        assert not any("Only your teacher" in str(each) for each in page.made), "it asks for no name"
        (learner,) = server.sessions.learners
        hall.call(learner.token, "somebody else")
        assert hall.name_of(learner.token) == "zoë"
    assert eventually(lambda: not learner.attached, LONG)
    enter = server.sessions.enter
    other = enter([learner.token], print, "max")
    assert other is not None and other is not learner
    assert enter([learner.token], print, "zoë") is learner


def test_an_account_keeps_its_row_and_names_may_be_left_out() -> None:
    """Another browser with the same account continues in the same row. A class without names stores no
    account."""
    place = LessonPlace("a-redundant-arm")
    begun = Gathering().entered("one", "robot", 0.0, "zoe").entered("two", "robot", 0.0, "max")
    left = begun.going_to(place).opened().voted("one", 0, 1.0).left("one")
    assert left.succeeded("new", ["one"], "max") == left, "a browser that both used proves nothing"
    again = left.succeeded("new", [], "zoe").entered("new", "robot", 2.0, "zoe")
    assert [(each.number, each.name) for each in again.members.values()] == [(1, "zoe"), (2, "max")]
    assert again.poll is not None and again.poll.latest == {"new": 0}
    nameless = Gathering(named=False).entered("one", "robot", 0.0, "zoe")
    assert "zoe" not in repr(nameless) and for_teacher(nameless, 0.0)["rows"][0]["name"] == ""


def test_the_command_asks_for_the_address_of_the_proxy(capsys: pytest.CaptureFixture[str]) -> None:
    assert main(["--no-browser", "--class", "--proxy-only"]) == 2
    assert "--trusted-origin https://lab.example.org" in capsys.readouterr().err
