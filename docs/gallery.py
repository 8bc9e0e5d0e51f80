"""Walks through every lesson in a real browser and stores screenshots: docs/lessons/NAME.webp and an index.

python -m docs.gallery [NAME …] [--out docs/lessons]
"""

from __future__ import annotations

import argparse
import io
from pathlib import Path

from matplotlib.font_manager import findfont
from PIL import Image, ImageDraw, ImageFont
from playwright.sync_api import Page, expect, sync_playwright

from app.link.choice import SceneChoice
from app.link.exercise import parts_of
from app.web.server import PageServer, ServerOptions
from browsing.browser_actions import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, open_page
from browsing.lessons import expect_part, hurry, open_lesson, predict, run, title_of
from lessons.course import COURSE, load_lesson
from lessons.exercises import exercises_of
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Lesson, Step

ROOT = Path(__file__).parents[1]
WIDTH, HEIGHT = 1200, 920
SHOWN = 0.5  # scale of the stored pictures
QUALITY = 25


def walk(page: Page, lesson: Lesson) -> list[tuple[str, Image.Image, Image.Image]]:
    """Returns (title, picture before the run, picture after it) of every step and of the challenge's
    start."""
    open_lesson(page, lesson)
    parts, found = parts_of(lesson), []
    for part in parts:
        expect_part(page, lesson, part)
        if isinstance(part, Step) and part.prediction is not None:
            predict(page, part.prediction)
        before = look(page)
        hurry(page)
        run(page, "Run this step" if isinstance(part, Step) else "Start the run")
        found.append((title_of(part), before, look(page)))
        if part is not parts[-1]:
            page.get_by_role("button", name="Next: ").click()
    return found


def look(page: Page) -> Image.Image:
    page.mouse.move(20, 200)  # at other positions the mouse would show a hint
    page.wait_for_timeout(1200)
    return Image.open(io.BytesIO(page.screenshot())).convert("RGB")


def sheet(screens: list[tuple[str, Image.Image, Image.Image]]) -> Image.Image:
    """Returns one picture with a row per step."""
    line = 18
    wide, high = round(WIDTH * SHOWN), round(HEIGHT * SHOWN)
    paper = Image.new("RGB", (2 * wide, len(screens) * (high + line)), "white")
    pen, font = ImageDraw.Draw(paper), ImageFont.truetype(findfont("DejaVu Sans"), 12)
    for k, (title, before, after) in enumerate(screens):
        for x, words, screen in ((0, "before", before), (wide, "after", after)):
            y = k * (high + line)
            pen.text((x + 6, y + 3), f"{title}: {words} the run", fill="black", font=font)
            paper.paste(screen.resize((wide, high), Image.Resampling.LANCZOS), (x, y + line))
    return paper


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(COURSE))
    parser.add_argument("--out", type=Path, default=ROOT / "docs" / "lessons")
    options = parser.parse_args()
    options.out.mkdir(parents=True, exist_ok=True)
    expect.set_options(timeout=SLOW)
    server = PageServer(SceneChoice(RunSpec("planar3-hold")), ServerOptions(port=0, max_sessions=1))
    try:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
            page = open_page(browser, server.link, WIDTH, HEIGHT, scale=1.0, rest=SELDOM)
            for name in options.names:
                lesson = load_lesson(name)
                sheet(walk(page, lesson)).save(options.out / f"{name}.webp", quality=QUALITY, method=6)
                print(f"{name}: {(options.out / f'{name}.webp').stat().st_size / 1000:.0f} kB", flush=True)
            browser.close()
    finally:
        server.close()
    write_index(options.out)


def write_index(out: Path) -> None:
    """Writes a page with all pictures."""
    lines = [
        "# The lessons, walked through",
        "",
        "The pictures show every step before and after its run, as on the page; `python -m docs.gallery`",
        "makes them. The predictions in them are plausible, but many of them are wrong.",
        "",
        "![The page on a desktop and on a phone, from the first start to *Deliveries*](first-minutes.webp)",
    ]
    for number, name in enumerate(COURSE, start=1):
        if (out / f"{name}.webp").exists():
            card = load_lesson(name).card
            lines += [
                "",
                f"## {number}. {card.title}",
                "",
                card.question,
                "",
                f"![{card.title}]({name}.webp)",
            ]
            for each in exercises_of(name):
                own = each.card
                lines += [
                    "",
                    f"**Write it yourself: {own.title}** ({own.minutes} minutes). {own.question}",
                    "",
                    "```sh",
                    *each.commands(),
                    "```",
                    *(["", each.before] if each.before else []),
                ]
    (out / "README.md").write_text("\n".join(lines) + "\n", encoding="utf-8")


if __name__ == "__main__":
    main()
