"""Fixtures that start simulations, and viser's own server. The fork server of the tests' process lives
through all tests, because its start takes a second of a core."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import viser
from served import Start

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.fork_server import SERVER
from app.link.process import Spares
from app.web.sessions import WORKER
from lessons.scenes.run_spec import RunSpec


@pytest.fixture(scope="module")
def viser_server() -> Iterator[viser.ViserServer]:
    server = viser.ViserServer(host="127.0.0.1", port=0, verbose=False)
    yield server
    server.stop()


@pytest.fixture(scope="session", autouse=True)
def one_fork_server() -> Iterator[None]:
    """Keeps the fork server when the servers of a test have ended."""
    kept = Spares(WORKER)
    yield
    kept.close()


@pytest.fixture
def start() -> Iterator[Start]:
    """Returns a function that starts simulations of one worker; all are closed at the end. own_server: the
    test has a fork server of its own, which prepares this worker."""
    made: list[Spares] = []
    started: list[SimulationClient] = []
    own: list[bool] = []

    def run(scene: str | RunSpec, worker: str = WORKER, own_server: bool = False) -> SimulationClient:
        if own_server and not own:
            SERVER.end()
            own.append(True)
        if not made:
            made.append(Spares(worker))
        choice = SceneChoice(RunSpec(scene) if isinstance(scene, str) else scene)
        learner = SimulationClient(f"token{len(started)}", choice, made[-1])
        started.append(learner)
        return learner

    yield run
    for learner in started:
        learner.close()
    for spares in made:
        spares.close()
    if own:
        SERVER.end()
