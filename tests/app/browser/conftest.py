"""Fixtures of the page's tests: one browser and one server for all that can share them."""

from __future__ import annotations

import os
from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect, sync_playwright

from app.link.choice import SceneChoice
from app.server.server import PageServer
from browsing.hands import CHROMIUM_ARGS, find_chromium, open_page, press, tab, wait_for_scene
from lessons.scenes.run_spec import RunSpec


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    path = find_chromium()
    if path is None:
        reason = "no Chromium found: install one (Debian: apt-get install chromium) to test the page"
        if os.environ.get("CI") == "true":
            pytest.fail(reason)
        pytest.skip(reason)
    expect.set_options(timeout=30_000)
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=CHROMIUM_ARGS)
        yield chromium
        chromium.close()


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
