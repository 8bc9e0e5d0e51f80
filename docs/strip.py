"""Makes docs/lessons/first-minutes.webp: the page on a desktop and on a phone, from the first start to
*Deliveries*.

python -m docs.strip
"""

from __future__ import annotations

from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import Browser, Page, expect, sync_playwright

from app.link.choice import SceneChoice
from app.web.server import PageServer, ServerOptions
from browsing.browser_actions import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, open_page, press, tab
from browsing.lessons import expect_part, hurry, open_lesson, predict, run
from docs.gallery import ROOT, look
from lessons.course import load_lesson
from lessons.scenes.run_spec import RunSpec

OUT = ROOT / "docs" / "lessons" / "first-minutes.webp"
SIZES = {"desktop": (1440, 900, 0.42), "phone": (390, 844, 0.78)}
"""Width and height of the window, and the scale of its stored pictures."""
LINE, ROW = 18, 3
LESSONS = ("a-redundant-arm", "a-blind-arm", "deliveries")


def shots(browser: Browser, server: PageServer, device: str) -> list[tuple[str, Image.Image]]:
    """Returns the pictures of a device with their titles."""
    width, height, scale = SIZES[device]
    page = open_page(browser, server.link, width, height, scale=1.0, rest=SELDOM)
    found = [("first start", _small(page, scale))]
    tab(page, "Tasks")
    page.get_by_role("button", name="⋯").first.click()
    found.append(("Tasks", _small(page, scale)))
    for name in LESSONS:
        lesson = load_lesson(name)
        open_lesson(page, lesson)
        step = lesson.steps[0]
        expect_part(page, lesson, step)
        if name == LESSONS[0]:
            found.append((f"{lesson.card.title}: the question", _small(page, scale)))
        assert step.prediction is not None
        predict(page, step.prediction)
        hurry(page)
        run(page)
        press(page, "Pause")
        found.append((f"{lesson.card.title}: the answer", _small(page, scale)))
    page.context.close()
    return [(f"{device}, {title}", picture) for title, picture in found]


def _small(page: Page, scale: float) -> Image.Image:
    screen = look(page)
    size = (round(screen.width * scale), round(screen.height * scale))
    return screen.resize(size, Image.Resampling.LANCZOS)


def strip(pictures: list[tuple[str, Image.Image]]) -> Image.Image:
    """Returns one picture with rows of three."""
    rows = [pictures[k : k + ROW] for k in range(0, len(pictures), ROW)]
    wide = max(sum(picture.width + 6 for _, picture in row) for row in rows)
    paper = Image.new("RGB", (wide, sum(row[0][1].height + LINE for row in rows)), "white")
    pen, font, y = ImageDraw.Draw(paper), ImageFont.truetype(findfont("DejaVu Sans"), 12), 0
    for row in rows:
        x = 0
        for title, picture in row:
            pen.text((x + 3, y + 3), title, fill="black", font=font)
            paper.paste(picture, (x, y + LINE))
            x += picture.width + 6
        y += row[0][1].height + LINE
    return paper


def main() -> None:
    expect.set_options(timeout=SLOW)
    pictures: list[tuple[str, Image.Image]] = []
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
        for device in SIZES:
            server = PageServer(SceneChoice(RunSpec("iiwa14-hold")), ServerOptions(port=0, max_sessions=1))
            try:
                pictures += shots(browser, server, device)
            finally:
                server.close()
        browser.close()
    strip(pictures).save(OUT, quality=45, method=6)
    print(f"{OUT}: {len(pictures)} pictures, {OUT.stat().st_size / 1000:.0f} kB")


if __name__ == "__main__":
    main()
