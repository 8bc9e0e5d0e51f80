"""Makes the README's animated picture, docs/page.webp: a lesson's step as the page plays it back.

python -m docs.picture
"""

from __future__ import annotations

import io
from pathlib import Path

from PIL import Image
from playwright.sync_api import Page, expect, sync_playwright

from app.link.choice import SceneChoice
from app.link.exercise import LessonPlace
from app.web.server import PageServer, ServerOptions
from browsing.browser_actions import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, key, open_page, press
from browsing.lessons import expect_part, predict, run
from lessons.teaching.lesson import Step

OUT = Path(__file__).parents[1] / "docs" / "page.webp"
EXERCISE = LessonPlace("a-redundant-arm", 2)
SIZE = (1080, 675)
EVERY, LAST = 100, 1500
"""Time, ms, for which a picture is shown; the last picture is shown longer so that it can be read."""


def main() -> None:
    expect.set_options(timeout=SLOW)
    server = PageServer(SceneChoice.of_lesson(EXERCISE), ServerOptions(port=0, max_sessions=1))
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
            page = open_page(browser, server.link, 1440, 900, scale=1.0, rest=SELDOM)
            part = EXERCISE.part
            expect_part(page, EXERCISE.whole, part)
            if isinstance(part, Step) and part.prediction is not None:
                predict(page, part.prediction)
            run(page)
            pictures = played_back(page, part.duration)
            browser.close()
    finally:
        server.close()
    pictures[0].save(
        OUT,
        save_all=True,
        append_images=pictures[1:],
        duration=[EVERY] * (len(pictures) - 1) + [LAST],
        loop=0,
        quality=60,
        method=6,
    )
    print(f"{OUT}: {len(pictures)} pictures, {OUT.stat().st_size / 1e6:.2f} MB")


def played_back(page: Page, seconds: float) -> list[Image.Image]:
    """Returns pictures of the run, one per tenth of a second of simulated time. They show the playback of the
    finished run, so that the speed of the machine does not matter."""
    press(page, "Pause")  # playback requires a paused robot
    page.mouse.move(40, 300)  # at other positions the mouse would show a hint
    for _ in range(round(seconds) + 1):
        key(page, "Shift+J")
    pictures = []
    for _ in range(round(10 * seconds)):
        page.wait_for_timeout(3 * SELDOM)
        shown = Image.open(io.BytesIO(page.screenshot())).convert("RGB")
        pictures.append(shown.resize(SIZE, Image.Resampling.LANCZOS))
        key(page, "k")
    return pictures


if __name__ == "__main__":
    main()
