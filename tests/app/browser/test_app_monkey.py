"""One minute of random actions in a real browser."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser

from app.link.choice import SceneChoice
from app.web.server import PageServer
from benchmarks.findings import StandardError
from benchmarks.monkey import walk
from lessons.scenes.run_spec import RunSpec


@pytest.mark.nightly("benchmarks/monkey.py", "app/link", "app/page")
def test_a_minute_of_anything_breaks_nothing(browser: Browser) -> None:
    with StandardError() as said:
        server = PageServer(SceneChoice(RunSpec("planar3-hold")), port=0, max_sessions=1)
        try:
            found = walk(browser, server, minutes=1.0, seed=0, complaints=said.read)
        finally:
            server.close()
    assert found.faults == []
    assert found.rows > 0
    assert sum(found.actions.values()) > 3
