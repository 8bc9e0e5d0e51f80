"""Functions that act as a learner in a lesson on the page: open the lesson, predict, run, read, continue."""

from __future__ import annotations

import re

from playwright.sync_api import Locator, Page, expect

from app.link.exercise import parts_of
from app.panels.lesson.cards import GROUPS
from browsing.browser_actions import BETWEEN, key, row, unfold
from lessons.course import COURSE
from lessons.teaching.lesson import Challenge, Lesson, Step
from lessons.teaching.prediction import Choice, Prediction, Sketch

RUN = 120_000  # time limit of a scripted run on a busy machine, ms


def open_lesson(page: Page, lesson: Lesson) -> None:
    """Opens a lesson: clicks on its card in the list of all lessons."""
    label = f"{COURSE.index(lesson.name) + 1} · {lesson.card.title}"
    key(page, "l")
    window = page.locator(".mantine-Modal-content")
    expect(window).to_be_visible()
    button = window.get_by_role("button", name=label)
    if not button.is_visible():
        unfold(
            page, next(f"Lessons: {title}" for title, (_, names) in GROUPS.items() if lesson.name in names)
        )
    button.click()
    expect(page.get_by_text(f"Lesson {COURSE.index(lesson.name) + 1}: {lesson.card.title}")).to_be_visible()
    expect_part(page, lesson, lesson.steps[0])


def title_of(part: Step | Challenge) -> str:
    return part.title if isinstance(part, Step) else "Challenge"


def expect_part(page: Page, lesson: Lesson, part: Step | Challenge) -> None:
    """Checks that a step is shown and that its run has not begun."""
    parts = parts_of(lesson)
    expect(page.get_by_text(f"{parts.index(part) + 1} of {len(parts)}")).to_be_visible(timeout=RUN)
    expect(page.get_by_text(title_of(part), exact=True).first).to_be_visible()
    expect(page.get_by_text("DONE", exact=True)).to_have_count(0)


def predict(page: Page, prediction: Prediction) -> None:
    """Enters a prediction with the controls that are shown."""
    if isinstance(prediction, Choice):
        letter, text = "ABCDEFG"[prediction.tempting], prediction.options[prediction.tempting].text
        option = page.get_by_role("button", name=re.compile(rf"^{letter}\s+{re.escape(text)}"))
        option.click()
        expect(option).to_have_accessible_name(re.compile("your answer"))
        return
    label = f"at {prediction.until / 5:.2g} s" if isinstance(prediction, Sketch) else "My guess"
    # The arrow keys cannot be used: viser also turns the camera with them.
    track = row(page, label).locator(".mantine-Slider-trackContainer")
    box = track.bounding_box()
    assert box is not None
    track.click(position={"x": 0.62 * box["width"], "y": 0.5 * box["height"]})
    page.wait_for_timeout(BETWEEN)


def hurry(page: Page) -> None:
    """Sets the highest speed of the run."""
    box = row(page, "As fast as possible").get_by_role("checkbox")
    if not box.is_checked():
        box.click()
        page.wait_for_timeout(BETWEEN)


def run(page: Page, button: str = "Run this step") -> None:
    """Presses a button that starts a run, and waits until the run has ended."""
    page.get_by_role("button", name=button, exact=True).click()
    expect(page.get_by_text("DONE", exact=True)).to_be_visible(timeout=RUN)


_TEXTS = """() => {
  const seen = [], formulas = new Set(), all = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (all.nextNode()) {
    const node = all.currentNode, around = node.parentElement, formula = around.closest("math");
    if (!node.textContent.trim() || !around.checkVisibility()) continue;
    if (around.closest("style, script, title, .hl-at, .mantine-Notifications-root")) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    const drawn = [...range.getClientRects()].some((box) => {
      const x = box.left + box.width / 2, y = box.top + box.height / 2;
      if (box.width < 2 || box.height < 2) return false;
      const top = document.elementFromPoint(x, y);  // null outside of the window
      return top && (around.contains(top) || top.contains(around));
    });
    if (!drawn || formulas.has(formula)) continue;
    if (formula) formulas.add(formula);
    seen.push(formula ? "formula" : node.textContent);
  }
  return seen;
}"""


def words_in_view(page: Page) -> int:
    """Returns the number of words on the screen, with the names of tabs, buttons and curves: of every text
    that is drawn and not covered or scrolled away, the pieces with a letter. A formula is one word."""
    return sum(any(map(str.isalpha, word)) for text in page.evaluate(_TEXTS) for word in text.split())


def marks(page: Page, sign: str) -> Locator:
    """Returns the claims or goals with a mark: "✓", "✗" or "…"."""
    return page.get_by_text(sign, exact=True)
