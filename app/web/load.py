"""The load of a server, for a proxy that distributes visitors and for Prometheus."""

from __future__ import annotations

import json
from dataclasses import dataclass
from http import HTTPStatus
from typing import TYPE_CHECKING
from urllib.parse import urlsplit

if TYPE_CHECKING:  # the server listens before this module is loaded
    from app.web.sessions import Classroom, Sessions

PATHS = "/health", "/metrics"
"""The addresses of the load."""
_JSON, _PROMETHEUS = "application/json", "text/plain; version=0.0.4; charset=utf-8"


@dataclass(frozen=True)
class Load:
    """The present load of a server.

    Attributes:
        sessions: number of simulations that run, also those whose browser may come back.
        attached: number of simulations that a page uses.
        maximum: largest number of sessions; 0 if nobody is refused, as in a classroom.
        connections: number of open connections.
        refused: number of requests refused since the start.
        messages: number of messages from pages since the start.
        stopping: True while the server starts or stops.
    """

    sessions: int
    attached: int
    maximum: int
    connections: int
    refused: int
    messages: int
    stopping: bool

    @property
    def full(self) -> bool:
        """Whether pages use as many simulations as the server may have. Simulations that wait for a browser
        to come back do not count."""
        return 0 < self.maximum <= self.attached

    @property
    def state(self) -> str:
        return "stopping" if self.stopping else "full" if self.full else "open"


def load_of(
    places: Sessions | Classroom | None, connections: int, refused: int, messages: int, stopping: bool
) -> Load:
    """Returns the load of a server. places: None before the server is open."""
    learners = () if places is None else places.learners
    attached = sum(each.attached for each in learners)
    most = places.max_sessions if places is not None and places.turns_away else 0
    return Load(len(learners), attached, most, connections, refused, messages, stopping)


def report(path: str, load: Load) -> tuple[HTTPStatus, str, str] | None:
    """Returns status, type and text of the response to /health or /metrics; None for every other path."""
    match urlsplit(path).path:
        case "/health":
            text = {"state": load.state, "sessions": load.sessions, "maximum": load.maximum}
            status = HTTPStatus.OK if load.state == "open" else HTTPStatus.SERVICE_UNAVAILABLE
            return status, _JSON, json.dumps(text) + "\n"
        case "/metrics":
            return HTTPStatus.OK, _PROMETHEUS, "".join(_lines(load))
        case _:
            return None


def _lines(load: Load) -> list[str]:
    rows = (
        ("himpc_lab_sessions", "gauge", "Simulations that run.", load.sessions),
        ("himpc_lab_sessions_attached", "gauge", "Simulations that a page uses.", load.attached),
        ("himpc_lab_sessions_maximum", "gauge", "Simulations that may run.", load.maximum),
        ("himpc_lab_connections", "gauge", "Open connections.", load.connections),
        ("himpc_lab_requests_refused_total", "counter", "Requests refused since the start.", load.refused),
        ("himpc_lab_messages_total", "counter", "Messages of pages since the start.", load.messages),
        ("himpc_lab_stopping", "gauge", "1 while the server starts or stops.", int(load.stopping)),
    )
    return [
        f"# HELP {name} {words}\n# TYPE {name} {kind}\n{name} {value}\n" for name, kind, words, value in rows
    ]
