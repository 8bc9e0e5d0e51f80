"""A class in a real browser: phones vote, and the teacher's page shows the votes."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from playwright.sync_api import Browser, Page, expect
from served import served

from app.link.choice import SceneChoice
from app.web.server import PageServer, ServerOptions
from browsing.browser_actions import load_axe, violations

pytestmark = pytest.mark.nightly(
    *(f"app/{part}" for part in ("adapter", "classes", "client", "link", "page", "panels/run", "web")),
    "browsing/",
)


@pytest.fixture(scope="module")
def classroom() -> Iterator[PageServer]:
    with served(classroom=True, class_names=True, max_sessions=4) as running:
        yield running


LONG = 120_000  # ms


def page_of(browser: Browser, address: str, width: int, height: int, faults: list[str]) -> Page:
    """Opens a page of the class. faults: gets the errors of the page's script, and what the page's policy
    refuses."""
    page = browser.new_context(viewport={"width": width, "height": height}).new_page()
    page.on("pageerror", lambda error: faults.append(str(error)))
    page.on("console", lambda said: faults.append(said.text) if said.type == "error" else None)
    page.goto(address)
    load_axe(page)
    return page


def test_a_phone_votes_and_the_projector_shows_who_was_right(browser: Browser, classroom: PageServer) -> None:
    """A step with two votes and its run is done by clicks. Both pages fit their screens, and axe finds no
    violation."""
    faults: list[str] = []
    assert classroom.hall is not None
    lead = page_of(browser, classroom.first_link, 1920, 1080, faults)
    phone = page_of(browser, f"{classroom.url}/v/{classroom.hall.code}", 390, 844, faults)
    assert "himpc-token" not in lead.url
    expect(lead.locator("#qr svg")).to_be_visible()
    lead.get_by_label("Lesson", exact=True).select_option("stretched-out")
    lead.get_by_role("button", name="Go to this step").click()
    expect(lead.locator("#question")).not_to_have_text("Choose a lesson and a step.")
    expect(phone.locator("#question")).to_have_text(lead.locator("#question").inner_text())
    for vote, letter in (("Vote: 1 answered", "A"), ("Second vote: 1 answered", "B")):
        lead.get_by_role("button", name="Open the ").click()
        phone.locator("#answers button", has_text=letter).first.click()
        expect(phone.get_by_text("Counted.")).to_be_visible()
        expect(phone.get_by_text(f"You said {letter}.")).to_be_visible()
        expect(lead.get_by_text(vote)).to_be_visible()
        expect(lead.locator("#bars li")).to_have_count(0)
        if letter == "A":
            assert violations(phone) + violations(lead) == []
        lead.get_by_role("button", name="Close the vote").click()
        expect(phone.locator("#bars li")).to_have_count(3)
    expect(lead.locator("#bars .count").first).to_have_text("1 → 0")
    lead.get_by_role("button", name="Run", exact=True).click()
    expect(lead.locator("#result")).to_contain_text("The run gave", timeout=LONG)
    expect(phone.locator("#bars .right")).to_have_count(1)
    lead.locator("summary").click()
    assert violations(phone) + violations(lead) == []
    for page in (lead, phone):
        assert page.evaluate("document.documentElement.scrollWidth <= innerWidth"), "it fits its width"
    with lead.expect_download() as told:
        lead.get_by_text("Votes and progress as CSV").click()
    rows = told.value.path().read_text().splitlines()
    assert rows[0].startswith("number,name,kind") and ",A,B," in rows[1]
    assert faults == []
    phone.context.close()
    lead.context.close()


def test_pages_of_a_class_that_has_ended_say_so(browser: Browser) -> None:
    """Phone and projector lose their connection. The next class at the same address has another code."""

    def started(port: int) -> PageServer:
        choice = SceneChoice.opening("stretched-out")
        return PageServer(choice, ServerOptions(port=port, classroom=True, class_names=True))

    first = started(0)
    assert first.hall is not None
    lead = page_of(browser, first.first_link, 1920, 1080, [])
    phone = page_of(browser, f"{first.url}/v/{first.hall.code}", 390, 844, [])
    expect(phone.locator("#question")).to_contain_text("Wait for your teacher")
    expect(lead.get_by_text("Phones cannot reach this address")).to_be_visible()
    expect(lead.get_by_label("Lesson", exact=True)).to_have_value("stretched-out")  # as the class was started
    first.close()
    expect(phone.get_by_text("The connection is interrupted")).to_be_visible()
    second = started(int(first.url.rpartition(":")[2]))
    try:
        says = "The class has started anew: scan the code again."
        expect(phone.get_by_text(says)).to_be_visible(timeout=LONG)
        expect(lead.get_by_text("The class has started anew")).to_be_visible(timeout=LONG)
    finally:
        second.close()
        phone.context.close()
        lead.context.close()
