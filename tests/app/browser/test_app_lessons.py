"""Every lesson is done in a real browser, with the actions of a learner."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from playwright.sync_api import Browser, Locator, Page, expect
from served import served

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace, parts_of
from app.link.messages import Post
from app.panels.inside.plane import TITLE as PLANE
from app.web.server import PageServer
from browsing.browser_actions import eventually, key, open_page, press
from browsing.lessons import expect_part, hurry, marks, open_lesson, predict, run, words_in_view
from lessons.authoring.lesson import lesson_named
from lessons.authoring.new import text_of
from lessons.course import COURSE, load_lesson
from lessons.events import Set
from lessons.settings.assignments import parse_assignment
from lessons.teaching.lesson import Challenge, Lesson

BEFORE, AFTER = 120, 180
"""Largest number of words on the screen in a step, before and after its run."""
UNSEEN = 1500
"""Time between two pictures, ms: these tests read the panel and never look at the 3D view."""


@pytest.fixture(scope="module")
def school() -> Iterator[PageServer]:
    with served(SceneChoice.of_lesson(LessonPlace(COURSE[0], 1))) as running:
        yield running


@pytest.fixture(scope="module")
def learner_page(browser: Browser, school: PageServer) -> Iterator[Page]:
    opened = open_page(browser, school.link, 1440, 900, rest=UNSEEN)
    yield opened
    opened.context.close()


def test_a_page_can_open_at_a_lesson(learner_page: Page) -> None:
    lesson = load_lesson(COURSE[0])
    expect_part(learner_page, lesson, lesson.steps[1])
    expect(learner_page.get_by_text("Paused", exact=True).first).to_be_visible()
    key(learner_page, "p")
    expect(learner_page.get_by_text("Make a prediction first:")).to_be_visible()
    key(learner_page, "b")
    expect_part(learner_page, lesson, lesson.steps[0])
    key(learner_page, "n")
    expect_part(learner_page, lesson, lesson.steps[1])


ALWAYS = (COURSE[0], "one-task", "first-hold-then-reach", COURSE[-1])
"""Lessons that are walked through at every push: with all kinds of predictions, challenges, both levels, and
a robot of one's own. Any other one at night, and at a push that changes it."""


@pytest.mark.parametrize(
    "name",
    [
        name if name in ALWAYS else pytest.param(name, marks=pytest.mark.nightly(f"lessons/course/{name}."))
        for name in COURSE
    ],
)
def test_a_lesson_is_walked_through(learner_page: Page, school: PageServer, name: str) -> None:
    page, lesson = learner_page, load_lesson(name)
    open_lesson(page, lesson)
    walk(page, school, lesson)
    assert eventually(page, lambda: kept(page)["seen"].get(name) == list(range(len(parts_of(lesson)))))


def test_a_lesson_of_ones_own_is_walked_through(browser: Browser, tmp_path: Path) -> None:
    file = tmp_path / "mine.md"
    file.write_text(text_of("lesson", None, "mine.md"))
    with served(SceneChoice.opening(str(file))) as server:
        page = open_page(browser, server.link, 1440, 900)
        walk(page, server, lesson_named(str(file)))
        page.context.close()


def walk(page: Page, school: PageServer, lesson: Lesson) -> None:
    """Does every part of the open lesson with the actions of a learner. All claims must hold."""
    for part in parts_of(lesson):
        expect_part(page, lesson, part)
        if isinstance(part, Challenge):
            take_challenge(page, school, part, fails=lesson.name in ALWAYS)
            continue
        assert eventually(page, lambda: words_in_view(page) <= BEFORE), words_in_view(page)
        expect(page.get_by_text("No run yet.")).to_be_hidden()  # the row of plots is folded
        if part.prediction is not None:
            predict(page, part.prediction)
        hurry(page)
        run(page)
        expect(marks(page, "✓")).to_have_count(len(part.claims))
        expect(marks(page, "✗")).to_have_count(0)
        expect(page.get_by_text("You predicted:")).to_have_count(int(part.prediction is not None))
        assert eventually(page, lambda: words_in_view(page) <= AFTER), words_in_view(page)
        plots = re.compile(f"^(?!your sketch).* over time$|^{PLANE}$")
        drawn = page.get_by_role("img", name=plots).first
        assert eventually(page, partial(is_high, drawn))
        assert_order(page.get_by_text("Now you:"), page.get_by_text("Your knobs"), next_of(page))
        if part is not parts_of(lesson)[-1]:
            next_of(page).click()


def test_a_phone_asks_first_then_plots(browser: Browser) -> None:
    with served(SceneChoice.of_lesson(LessonPlace(COURSE[0]))) as server:
        page = open_page(browser, server.link, 390, 844)
        part = load_lesson(COURSE[0]).steps[0]
        assert part.prediction is not None
        expect(page.get_by_role("tab")).to_have_text(["Learn", "Tasks", "More"])
        option = page.get_by_role("button", name=re.compile("one or two"))
        go, idea = (
            page.get_by_role("button", name="Run (answer first)"),
            page.get_by_text("The arm has seven joints").last,
        )
        assert_order(page.get_by_text("Predict:"), option, go, idea, page.get_by_text("Paused", exact=True))
        box = go.bounding_box()
        assert box is not None and box["y"] + box["height"] < 844, "the answers are in view"
        predict(page, part.prediction)
        hurry(page)
        run(page)
        drawn = page.get_by_role("img", name=re.compile("over time$")).first
        assert_order(option, drawn, page.get_by_text("Why", exact=True))
        expect(page.get_by_text("press P", exact=False)).to_have_count(0)
        page.context.close()


def is_high(drawn: Locator) -> bool:
    """Returns whether a drawing is at least 200 px high; a new one gets its size a moment later."""
    box = drawn.bounding_box()
    return box is not None and box["height"] >= 200


def next_of(page: Page) -> Locator:
    return page.get_by_role("button", name="Next: ")


def assert_order(*shown: Locator) -> None:
    """Checks that the page shows these one below the other."""
    tops = []
    for each in shown:
        expect(each).to_be_visible()
        box = each.bounding_box()
        assert box is not None
        tops.append(box["y"])
    assert tops == sorted(tops)


def kept(page: Page) -> dict[str, Any]:
    """Returns the data about lessons in the browser's local storage."""
    return json.loads(
        page.evaluate(
            """() => { const k = Object.keys(localStorage).find((k) => k.endsWith("himpc-lab-lessons"));
                 return k ? localStorage.getItem(k) : '{"seen": {}}'; }"""
        )
    )


def take_challenge(page: Page, school: PageServer, challenge: Challenge, fails: bool) -> None:
    """Checks that the challenge passes with a known solution; and, if `fails`, that it fails with its initial
    settings, which test_lessons_course.py tests of every challenge."""
    hurry(page)
    if fails:
        run(page, "Start the run")
        expect(page.get_by_text("NOT YET", exact=True)).to_be_visible()
        expect(page.get_by_role("button", name="Next: ")).to_have_count(0)
    learner = school.sessions.learners[0]
    for assignment in challenge.solutions[0]:
        learner.send(Post(Set(*parse_assignment(assignment))))
    press(page, "Start the run")
    expect(page.get_by_text("PASSED", exact=True)).to_be_visible(timeout=120_000)
    expect(marks(page, "✓")).to_have_count(len(challenge.goals))
    expect(page.get_by_text("Your best score:")).to_be_visible()
    expect(page.get_by_role("button", name="Next: ")).to_be_visible()


def test_the_cards_show_what_was_done(learner_page: Page) -> None:
    page = learner_page
    page.reload(wait_until="commit")
    expect(page.get_by_text(f"Lesson {len(COURSE)}:")).to_be_visible(timeout=60_000)
    key(page, "l")
    seen = kept(page)["seen"]
    walked = [name for name in COURSE if seen.get(name) == list(range(len(parts_of(load_lesson(name)))))]
    assert set(walked) >= set(ALWAYS)
    assert eventually(page, lambda: page.get_by_text("✓ DONE", exact=True).count() == len(walked))
    press(page, "Go to the laboratory")
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()
    expect(page.get_by_text("Running", exact=True).first).to_be_visible()
