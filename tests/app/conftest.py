"""Fixtures that start simulations, and one fork server. All tests whose subject is something else share this
server, because its start takes a second of a core."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest
from children import Start

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.forkserver import ForkServer
from app.link.spares import Spares
from app.server.sessions import WORKER
from lessons.scenes.run_spec import RunSpec


@pytest.fixture(scope="session")
def fork_server() -> Iterator[ForkServer | None]:
    """Yields the fork server, and None on systems that cannot fork."""
    try:
        made = ForkServer(WORKER)
    except OSError:
        yield None
        return
    yield made
    made.close()


@pytest.fixture(scope="module")
def one_fork_server(fork_server: ForkServer | None) -> Iterator[None]:
    """Page servers that are created in these tests fork their simulations from the shared fork server."""
    with pytest.MonkeyPatch.context() as patch:
        for place in ("sessions", "classroom"):
            patch.setattr(f"app.server.{place}.Spares", partial(Spares, lent=fork_server))
        yield


@pytest.fixture(scope="module")
def lent(fork_server: ForkServer | None) -> dict[str, ForkServer | None]:
    """Returns, by worker, the fork servers that tests may use but must not change."""
    return {WORKER: fork_server}


@pytest.fixture
def start(lent: dict[str, ForkServer | None]) -> Iterator[Start]:
    """Returns a function that starts simulations of one worker; all are closed at the end."""
    made: list[Spares] = []
    started: list[SimulationClient] = []

    def run(scene: str, worker: str = WORKER, own_server: bool = False) -> SimulationClient:
        if not made:
            made.append(Spares(worker, None if own_server else lent.get(worker)))
        learner = SimulationClient(f"token{len(started)}", SceneChoice(RunSpec(scene)), made[-1])
        started.append(learner)
        return learner

    yield run
    for learner in started:
        learner.close()
    for spares in made:
        spares.close()
