"""One fork server for pages of which something else is tested: each takes a second of a core to get ready."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial

import pytest

from app.link.forkserver import ForkServer
from app.link.spares import Spares
from app.server.sessions import WORKER


@pytest.fixture(scope="session")
def fork_server() -> Iterator[ForkServer | None]:
    """None where processes cannot be forked."""
    try:
        made = ForkServer(WORKER)
    except OSError:
        yield None
        return
    yield made
    made.close()


@pytest.fixture(scope="module")
def one_fork_server(fork_server: ForkServer | None) -> Iterator[None]:
    """Servers of pages that are made meanwhile fork their simulations from the one of all tests."""
    with pytest.MonkeyPatch.context() as patch:
        for place in ("sessions", "classroom"):
            patch.setattr(f"app.server.{place}.Spares", partial(Spares, lent=fork_server))
        yield
