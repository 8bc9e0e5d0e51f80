"""A classroom: one robot for all pages, and only pages with the token can control it."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, expect

from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.server.classroom import STEERING, Classroom
from app.server.server import PageServer
from browsing.browser_actions import open_page, press, write
from lessons.scenes.run_spec import RunSpec

pytestmark = pytest.mark.usefixtures("one_fork_server")


@pytest.fixture(scope="module")
def classroom() -> Iterator[PageServer]:
    running = PageServer(SceneChoice(RunSpec("planar3-hold")), port=0, classroom=True)
    yield running
    running.close()


def test_only_the_token_steers(browser: Browser, classroom: PageServer) -> None:
    """A page without the token shows the same robot and cannot stop it; with the token it can."""
    assert isinstance(classroom.sessions, Classroom)
    (learner,) = classroom.sessions.learners
    page = open_page(browser, classroom.link, 1300, 700)
    watching = page.get_by_text("you are watching")
    expect(watching).to_be_visible()
    press(page, "Pause")
    expect(page.get_by_text(STEERING).first).to_be_attached()
    assert learner.status is not None
    assert learner.status.running
    write(page, "Instructor's token", "wrong")
    expect(page.get_by_text("That is not the token.")).to_be_visible()
    write(page, "Instructor's token", classroom.sessions.token)
    expect(watching).to_have_count(0)
    press(page, "Pause")
    assert wait_until(lambda: learner.status is not None and not learner.status.running, 60)
    page.context.close()
