"""The first start, when nothing is compiled: the page opens at once and shows the progress of compilation."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from app.link.choice import SceneChoice
from app.link.fork_server import SERVER
from app.link.process import wait_until
from app.web.server import PageServer
from app.web.serving import opened_in_a_browser
from browsing.browser_actions import SLOW, eventually, new_page
from lessons.scenes.run_spec import RunSpec


def test_the_page_opens_while_it_is_compiled(
    browser: Browser, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The file that the browser opens first redirects to the page. The page counts the compiled functions and
    shows a recorded run."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    SERVER.end()  # that of earlier tests has compiled everything
    opened: list[str] = []
    monkeypatch.setattr("webbrowser.open", opened.append)
    server = PageServer(SceneChoice(RunSpec("iiwa14-hold")), port=0)
    page = new_page(browser)
    try:
        with opened_in_a_browser(server.link):
            assert wait_until(lambda: bool(opened), 10.0)
            page.goto(opened[0], wait_until="commit", timeout=SLOW)
            page.wait_for_url(f"{server.url}/", wait_until="commit", timeout=SLOW)

        def ready() -> int:
            found = re.search(r"(\d+) of \d+ functions", page.content())
            return int(found[1]) if found else 0

        assert eventually(page, lambda: ready() > 0, 60.0)
        first = ready()
        assert eventually(page, lambda: ready() > first, 60.0)
        assert page.get_by_text("PREPARING").is_visible()
        recorded = page.get_by_text("The robot plays a recorded run of this lesson.")
        assert eventually(page, recorded.is_visible, 60.0)
        (viewer,) = server._viser.get_clients().values()
        elbow = viewer.scene._handle_from_node_name["/recorded/3"]
        seen = elbow.wxyz.copy()
        assert eventually(page, lambda: float(abs(elbow.wxyz - seen).max()) > 0.01, 10.0)
        assert not page.get_by_text("Start again").is_visible()
    finally:
        page.context.close()
        server.close()
        SERVER.end()  # later tests use their own cache
