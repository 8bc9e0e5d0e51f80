"""Controls stay in place when a text above them changes, so that a click meets what the user aimed at."""

from __future__ import annotations

from itertools import pairwise

from playwright.sync_api import Page, expect

from browsing.browser_actions import pick, tab
from lessons.scenes.names import SCENES


def below(page: Page, button: str, first: str, place: int = 0) -> float:
    """The distance of a button from the text with which its tab begins, px. It does not depend on how far the
    tab is scrolled."""
    box = page.get_by_role("button", name=button, exact=True).nth(place).bounding_box()
    start = page.get_by_text(first, exact=False).first.bounding_box()
    assert box is not None and start is not None
    return box["y"] - start["y"]


def test_a_description_of_a_scene_moves_no_button(page: Page) -> None:
    """The descriptions have one and two lines."""
    tab(page, "Robot")
    before = below(page, "Load scene", "7 joints")
    for scene in ("panda-post", "baxter-conflict"):
        pick(page, "Scene", scene)
        expect(page.get_by_text(SCENES[scene])).to_be_visible()
        assert below(page, "Load scene", "7 joints") == before


def test_a_level_that_is_off_moves_no_button(page: Page) -> None:
    """Each level is one row of about 40 px, with its buttons at the right of its text."""
    tab(page, "Tasks")
    expect(page.get_by_text("1/7 free")).to_be_visible()
    first = "Each level gets the freedom"
    for place in range(2):  # an earlier test may have opened the weights of a level
        if below(page, "▼", first, place + 1) - below(page, "▼", first, place) > 100:
            page.get_by_role("button", name="⋯", exact=True).nth(place).click()
            page.wait_for_timeout(1000)
    before = [below(page, "▼", first, place) for place in range(3)]
    assert all(30 <= after - above <= 46 for above, after in pairwise(before)), before
    name, button = page.get_by_text("1 · position").bounding_box(), below(page, "▼", "1 · position")
    assert name is not None and abs(button) < name["height"]
    page.get_by_role("button", name="on", exact=True).first.click()
    expect(page.get_by_role("button", name="off", exact=True)).to_be_visible()
    assert [below(page, "▼", first, place) for place in range(3)] == before
    page.get_by_role("button", name="off", exact=True).click()
    expect(page.get_by_role("button", name="off", exact=True)).to_be_hidden()
