"""One server and one page for all tests that can share them, because without a graphics card a page needs ten
seconds of both cores to open."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page
from served import served

from app.link.choice import SceneChoice
from app.web.server import PageServer
from browsing.browser_actions import eventually, open_page, tab
from browsing.scene_switch import reset_all, show_scene
from lessons.own.files import Folder
from lessons.scenes.run_spec import RunSpec

CHOICE = SceneChoice(RunSpec("iiwa14-hold"))


@pytest.fixture(scope="package")
def server() -> Iterator[PageServer]:
    with served(CHOICE, max_sessions=2, grace=2.0, own_files=Folder.at(".")) as running:
        yield running


@pytest.fixture(scope="package")
def shared_page(browser: Browser, server: PageServer) -> Iterator[Page]:
    opened = open_page(browser, server.link)
    yield opened
    opened.context.close()


@pytest.fixture
def page(shared_page: Page, server: PageServer) -> Page:
    """Returns the page in its initial state, independent of the tests before. It is the only page on the
    server."""
    assert eventually(shared_page, lambda: len(server.sessions.learners) == 1)
    learner = server.sessions.learners[0]
    show_scene(shared_page, learner, CHOICE)
    tab(shared_page, "Errors")
    tab(shared_page, "Learn")
    reset_all(shared_page, learner)
    return shared_page
