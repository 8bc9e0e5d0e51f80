"""/health and /metrics, and a full server that sends newcomers to the next one."""

from __future__ import annotations

import json
import re
import threading
from dataclasses import replace
from http import HTTPStatus

import pytest
from served import get, served
from viser import __version__
from websockets.exceptions import InvalidStatus
from websockets.sync.client import connect

from app.link.messages import Post
from app.web.load import Load, report
from app.web.passes import HEADER
from browsing.wire import Wire, eventually
from lessons.events import Set
from lessons.replay.state import State, decode, encode

TOKEN = "a-token-of-ones-own-0"
_LINE = re.compile(r"# (HELP|TYPE) [a-z_]+ .+|[a-z_]+ \d+\.0")


def load(attached: int = 0, maximum: int = 2, stopping: bool = False) -> Load:
    return Load(attached, attached, maximum, 3, 5, 7, stopping)


@pytest.mark.parametrize(
    ("now", "state", "status"),
    [
        (load(1), "open", 200),
        (load(2), "full", 503),
        (load(0, stopping=True), "stopping", 503),
        (load(1, maximum=0), "open", 200),  # a classroom admits everybody
    ],
)
def test_health_is_good_while_a_newcomer_gets_a_place(now: Load, state: str, status: int) -> None:
    found = report("/health?x=1", now)
    assert found is not None and (found[0], found[1]) == (status, "application/json")
    assert json.loads(found[2]) == {"state": state, "sessions": now.sessions, "maximum": now.maximum}
    assert report("/healthy", now) is None and report("/", now) is None


def test_metrics_are_prometheus_text() -> None:
    """Every sample has its HELP and TYPE; counters end in _total."""
    found = report("/metrics", load(2))
    assert found is not None and found[0] is HTTPStatus.OK and "version=0.0.4" in found[1]
    lines = found[2].splitlines()
    assert found[2].endswith("\n") and all(_LINE.fullmatch(line) for line in lines)
    samples = dict(line.split() for line in lines if not line.startswith("#"))
    assert samples["himpc_lab_sessions"] == samples["himpc_lab_sessions_maximum"] == "2.0"
    kinds = dict(line.split()[2:4] for line in lines if line.startswith("# TYPE"))
    assert kinds.keys() == samples.keys()
    assert all((kind == "counter") == name.endswith("_total") for name, kind in kinds.items())


def test_a_full_server_sends_newcomers_away_and_takes_them_again() -> None:
    token = {HEADER: TOKEN}
    with served(token=TOKEN, refers=True) as server:
        assert get(f"{server.url}/health")[0] == 200
        assert get(f"{server.url}/health", Host="evil.example")[0] == 403
        assert get(server.url)[0] == 403
        assert get(server.url, **token)[0] == 200
        with Wire(server.link):
            assert eventually(lambda: len(server.sessions.learners) == 1)
            status, headers, text = get(f"{server.url}/health")
            assert (status, json.loads(text)["state"]) == (503, "full")
            status, headers, text = get(server.url, **token)
            assert status == 503 and "Refresh" in headers and "All places are taken" in text
            assert "himpc_lab_sessions_attached 1.0" in get(f"{server.url}/metrics")[2]
            with pytest.raises(InvalidStatus) as refused:
                connect(
                    server.url.replace("http", "ws"),
                    subprotocols=[f"viser-v{__version__}"],  # pyright: ignore[reportArgumentType]
                    additional_headers=token,
                )
            assert refused.value.response.status_code == 503
        assert eventually(lambda: get(f"{server.url}/health")[0] == 200)
        server.guard.close()
        assert json.loads(get(f"{server.url}/health")[2])["state"] == "stopping"


def test_a_change_of_a_setting_loads_no_robot_in_the_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """The simulation makes the code that the tab stores, which another server could open."""
    with served() as server, Wire(server.guest_link):
        assert eventually(lambda: bool(server.sessions.learners), 60.0)
        learner = server.sessions.learners[0]
        assert eventually(lambda: learner.code != "" and not server.loading, 60.0)
        loaded: list[str] = []

        def load(name: str, *_: object, **__: object) -> None:
            loaded.append(name)
            raise AssertionError("the server loads a scene")

        monkeypatch.setattr("lessons.runs.named.scene_named", load)
        monkeypatch.setattr("lessons.scenes.catalog.load_scene", load)
        for horizon in (6, 7, 8):
            learner.send(Post(Set("horizon", horizon)))

            def stored(horizon: int = horizon) -> bool:
                code = learner.code
                kept = [str(visit._stored) for visit in server._visits.values()]
                return f"horizon={horizon}" in decode(code).run.set and all(code in each for each in kept)

            assert eventually(stored, 60.0)
        assert loaded == []


def test_a_code_is_opened_on_a_thread_of_the_page(monkeypatch: pytest.MonkeyPatch) -> None:
    """On viser's loop it would stop all pages while two scenes are loaded."""
    ran: list[threading.Thread] = []

    def noted(code: str) -> State:
        ran.append(threading.current_thread())
        return decode(code)

    monkeypatch.setattr("app.panels.run.export.decode", noted)
    loops: list[threading.Thread] = []
    with served() as server:
        server._viser.get_event_loop().call_soon_threadsafe(lambda: loops.append(threading.current_thread()))
        with Wire(server.guest_link) as page:
            assert eventually(lambda: page.find("Open it") is not None, 60.0)
            (learner,) = server.sessions.learners
            assert eventually(lambda: learner.code != "", 60.0)
            code, button = page.find("Somebody's code"), page.find("Open it")
            assert code is not None and button is not None
            page.write(code, value=encode(replace(decode(learner.code), lesson="one-task", step=1)))
            page.write(button, value=True)
            assert eventually(lambda: bool(ran), 60.0)
            assert loops and ran[0] not in loops
