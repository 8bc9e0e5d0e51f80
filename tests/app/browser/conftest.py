"""Fixtures of the tests in a browser: one server and one page for all that can share them."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect

from app.link.choice import SceneChoice
from app.server.server import PageServer
from browsing.hands import open_page, press, tab, wait_for_scene
from lessons.scenes.run_spec import RunSpec


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    running = PageServer(SceneChoice(RunSpec("iiwa14-hold")), port=0, max_sessions=2, grace=2.0)
    yield running
    running.close()


@pytest.fixture(scope="module")
def shared_page(browser: Browser, server: PageServer) -> Iterator[Page]:
    opened = open_page(browser, server.url)
    yield opened
    opened.context.close()


@pytest.fixture
def page(shared_page: Page) -> Page:
    """One page for all tests, because opening one takes seconds without a graphics card; each test finds it
    as it was when it was opened."""
    tab(shared_page, "Start")
    press(shared_page, "Reset all")
    expect(shared_page.get_by_text("RUNNING", exact=True).first).to_be_visible()
    wait_for_scene(shared_page)
    return shared_page
