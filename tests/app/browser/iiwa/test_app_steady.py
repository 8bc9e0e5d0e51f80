"""Controls stay in place when a text above them changes, so that a click meets what the user aimed at."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from browsing.browser_actions import pick, row, tab
from lessons.scenes.names import SCENES


def top(page: Page, button: str, place: int = 0) -> float:
    """The distance of a button from the top of the page, px."""
    box = page.get_by_role("button", name=button, exact=True).nth(place).bounding_box()
    assert box is not None
    return box["y"]


def test_a_description_of_a_scene_moves_no_button(page: Page) -> None:
    """The descriptions have one and two lines."""
    tab(page, "Robot")
    before = top(page, "Load scene")
    for scene in ("panda-post", "baxter-conflict"):
        pick(page, "Scene", scene)
        expect(page.get_by_text(SCENES[scene])).to_be_visible()
        assert top(page, "Load scene") == before


def test_a_level_that_is_off_moves_no_button(page: Page) -> None:
    """A level that is off has a text of one line; the lowest level has one of three."""
    tab(page, "Tasks")
    expect(page.get_by_text("gets 1 of 7 directions", exact=False)).to_be_visible()
    before = [top(page, "▼ Down", place) for place in range(3)]
    box = row(page, "Enabled").get_by_role("checkbox")
    box.click()
    expect(page.get_by_text("OFF", exact=True)).to_be_visible()
    assert [top(page, "▼ Down", place) for place in range(3)] == before
    box.click()
    expect(page.get_by_text("OFF", exact=True)).to_be_hidden()
