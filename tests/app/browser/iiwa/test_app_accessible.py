"""The page in a real browser, checked by axe-core against WCAG 2.1 A and AA."""

from __future__ import annotations

import pytest
from playwright.sync_api import Page, expect

from app.tab.comfort import LINE
from browsing.browser_actions import key, load_axe, press, row, tab, unfold, violations

RIGHT = ("Learn", "Tasks", "Control", "Robot", "More/Compare", "More/Export", "More/Help")
LEFT = ("Errors", "Joints", "Inside", "Who binds")
AXE = pytest.mark.nightly("app/adapter", "app/html", "app/page", "app/panels", "app/view", "browsing/")


@pytest.fixture(scope="module")
def checked(shared_page: Page) -> Page:
    load_axe(shared_page)
    return shared_page


@AXE
def test_axe_finds_no_violation_of_wcag_on_any_tab(page: Page, checked: Page) -> None:
    found: list[str] = []
    press(page, "Pause")  # axe needs the processor

    def look(left: str, right: str, theme: str) -> None:
        """Checks a tab of each panel together, because a run of axe takes seconds."""
        tab(page, left)
        for name in right.split("/"):
            tab(page, name)
        page.wait_for_timeout(700)  # the names of new controls are added twice a second
        found.extend(f"{left}, {right}, {theme}: {each}" for each in violations(page))

    for place, right in enumerate(RIGHT):
        look(LEFT[min(place, len(LEFT) - 1)], right, "light")
    tab(page, "Learn")
    dark = row(page, "Dark theme").locator("input").first
    dark.click()
    page.wait_for_timeout(500)
    look("Errors", "Learn", "dark")
    look("Who binds", "Tasks", "dark")
    tab(page, "Learn")
    dark.click()
    assert not found, "\n".join(found)


@AXE
def test_axe_would_find_what_is_wrong(page: Page, checked: Page) -> None:
    """The check can fail: it finds a control without a name, and text of low contrast."""
    page.evaluate(
        """() => { const bad = document.createElement("div"); bad.id = "bad";
             bad.style.cssText = "position:fixed;top:0;left:45%;z-index:9999;background:#fff";
             bad.innerHTML = '<input type="text"><p style="color:#aaa;background:#fff">pale</p>';
             document.body.append(bad); }"""
    )
    try:
        found = violations(page)
    finally:
        page.evaluate("() => document.getElementById('bad').remove()")
    assert any(each.startswith("label:") for each in found) and any(
        "color-contrast" in each for each in found
    )


def test_keys_move_the_target_and_a_line_says_what_happened(page: Page) -> None:
    unfold(page, "Move a target by keys")
    field = page.get_by_label("Target y [m]", exact=True).first
    expect(field).to_be_visible()
    before = float(field.input_value())
    field.focus()
    page.keyboard.press("ArrowUp")
    assert abs(float(field.input_value()) - before - 0.01) < 1e-9
    field.blur()
    key(page, "1")
    line = page.locator(f"#{LINE}")
    expect(line).to_contain_text("level 1, position, switched off", ignore_case=True)
    box = line.bounding_box()
    assert box is not None and box["width"] <= 1, "nothing on the screen by default"
    assert line.get_attribute("role") == "status" and line.get_attribute("aria-live") == "polite"
    key(page, "1")
    page.get_by_text("Move a target by keys", exact=True).first.click()
