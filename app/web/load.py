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
_JSON = "application/json"


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
            return HTTPStatus.OK, *_metrics(load)
        case _:
            return None


def _metrics(load: Load) -> tuple[str, str]:
    # Loading the library takes 0.04 s; only a server that is watched needs it.
    from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily
    from prometheus_client.exposition import CONTENT_TYPE_PLAIN_0_0_4, generate_latest
    from prometheus_client.registry import Collector

    families = [
        kind(f"himpc_lab_{name}", words, value=value)
        for kind, name, words, value in (
            (GaugeMetricFamily, "sessions", "Simulations that run.", load.sessions),
            (GaugeMetricFamily, "sessions_attached", "Simulations that a page uses.", load.attached),
            (GaugeMetricFamily, "sessions_maximum", "Simulations that may run.", load.maximum),
            (GaugeMetricFamily, "connections", "Open connections.", load.connections),
            (CounterMetricFamily, "requests_refused", "Requests refused since the start.", load.refused),
            (CounterMetricFamily, "messages", "Messages of pages since the start.", load.messages),
            (GaugeMetricFamily, "stopping", "1 while the server starts or stops.", load.stopping),
        )
    ]

    class Present(Collector):
        def collect(self) -> list[CounterMetricFamily | GaugeMetricFamily]:
            return families

    return CONTENT_TYPE_PLAIN_0_0_4, generate_latest(Present()).decode()
