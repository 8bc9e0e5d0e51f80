"""Takes the README's picture: docs/page.png, the page with a lesson's step after its run.

python -m docs.picture
"""

from __future__ import annotations

from pathlib import Path

from playwright.sync_api import expect, sync_playwright

from app.link.choice import SceneChoice
from app.link.exercise import Exercise
from app.server.server import PageServer
from browsing.hands import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, open_page
from browsing.lessons import expect_part, predict, run
from lessons.teaching.lesson import Step

OUT = Path(__file__).parents[1] / "docs" / "page.png"
EXERCISE = Exercise("a-redundant-arm", 2)


def main() -> None:
    expect.set_options(timeout=SLOW)
    server = PageServer(SceneChoice.of_lesson(EXERCISE), port=0, max_sessions=1)
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
            page = open_page(browser, server.url, 1440, 900, scale=1.0, rest=SELDOM)
            part = EXERCISE.part
            expect_part(page, EXERCISE.whole, part)
            if isinstance(part, Step) and part.prediction is not None:
                predict(page, part.prediction)
            run(page)
            page.mouse.move(700, 850)  # or a hint would cover something
            page.wait_for_timeout(3000)
            page.screenshot(path=OUT)
            browser.close()
    finally:
        server.close()


if __name__ == "__main__":
    main()
