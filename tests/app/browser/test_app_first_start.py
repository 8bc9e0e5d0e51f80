"""The very first start, when nothing is compiled: the page opens at once and says how far it is."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from app.link.choice import SceneChoice
from app.server.server import PageServer
from browsing.hands import SLOW, eventually, new_page
from lessons.scenes.run_spec import RunSpec


def test_the_page_opens_while_it_is_compiled(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """And counts what is ready. (How the robot comes after that: every other test of the page.)"""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    server = PageServer(SceneChoice(RunSpec("iiwa14-hold")), port=0)
    page = new_page(browser)
    try:
        page.goto(server.url, wait_until="commit", timeout=SLOW)

        def ready() -> int:
            found = re.search(r"(\d+) of \d+ functions", page.content())
            return int(found[1]) if found else 0

        assert eventually(page, lambda: ready() > 0, 60.0)
        first = ready()
        assert eventually(page, lambda: ready() > first, 60.0)
        assert page.get_by_text("PREPARING").is_visible()
        assert not page.get_by_text("Start again").is_visible()
    finally:
        page.context.close()
        server.close()
