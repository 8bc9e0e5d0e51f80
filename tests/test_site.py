"""The documentation site is built without a warning. It is complete, its links are valid, and it loads
nothing from other hosts."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from typing import Literal
from urllib.parse import unquote, urlsplit

import pytest
from playwright.sync_api import Browser

from app.__main__ import main
from browsing.browser_actions import SLOW, eventually
from docs.further import further
from docs.pages.lessons import MEASURED, measured
from docs.record import FOLDER, OPENING, opening, plot, runs_of
from lessons.course import COURSE, load_lesson

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
SITE = pytest.mark.nightly(
    "README", "CONTRIBUTING", "CHANGELOG", "pyproject", "docs/", "examples/", "himpc/", "lessons/", "robots/"
)
"""The mark of all tests of the built site, which is made of these files."""
QUICK = "one-task"
"""The lesson whose numbers are measured again by these tests."""


class Parts(HTMLParser):
    """The links of a page, the resources that it loads, and its anchors."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        given = {name: value or "" for name, value in attrs}
        self.anchors.add(given.get("id", ""))
        if tag == "a" and "href" in given:
            self.links.append(given["href"])
        elif tag == "link" and given.get("rel") in ("stylesheet", "icon", "preload"):
            self.loads.append(given["href"])
        elif "src" in given:
            self.loads.append(given["src"])


@SITE
def test_every_link_leads_somewhere(site: Path) -> None:
    """Links to pages, anchors and pictures are relative and valid, from a file and from a server."""
    pages = {path: Parts(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    assert len(pages) > 60
    for path, parts in pages.items():
        for link in (*parts.links, *parts.loads):
            goal = urlsplit(link)
            if goal.scheme == "data":
                continue  # a data URL is part of the page itself
            if goal.scheme:
                assert link in parts.links, f"{path.name} loads {link}"
                continue
            target = (path.parent / unquote(goal.path)).resolve() if goal.path else path
            assert target.exists(), f"{path.relative_to(site)} leads to {link}"
            if goal.fragment and target in pages:
                assert unquote(goal.fragment) in pages[target].anchors, f"{path.name} leads to {link}"


@SITE
def test_styles_load_nothing_from_elsewhere(site: Path) -> None:
    for path in site.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", path.read_text(encoding="utf-8")), (
            path
        )


@SITE
def test_every_lesson_is_a_page(site: Path) -> None:
    """The page of a lesson contains its steps, its claims, and equations that a browser displays without a
    script."""
    text = ""
    for name in COURSE:
        text = (site / "lessons" / f"{name}.html").read_text(encoding="utf-8")
        for step in load_lesson(name).steps:
            assert step.title.split(" $")[0] in re.sub(r"&#x27;|’", "'", text)
        assert text.count("<table") > len(load_lesson(name).steps) - 1
    assert "<math" in text


@SITE
@pytest.mark.parametrize("name", COURSE)
def test_a_lesson_has_curves_a_derivation_and_answers(site: Path, name: str) -> None:
    """The page contains curves of every recorded step, a film, equations, and three answers that can be
    opened."""
    text = (site / "lessons" / f"{name}.html").read_text(encoding="utf-8")
    steps = load_lesson(name).steps
    assert text.count('<figure class="curves">') == len(steps)
    assert text.count("<svg viewBox=") >= len(steps)
    assert text.count(f'data-film="../films/player.html#{name}"') == 1
    assert text.count("<summary>Answer</summary>") == 3
    assert text.count('display="block"') >= len(further(name).derivation)
    player = (site / "films" / "player.html").stat().st_size
    assert player + (site / "films" / f"{name}.js").stat().st_size < 5e6


@SITE
def test_every_claim_on_a_page_has_been_measured(site: Path) -> None:
    told = measured(ROOT / MEASURED)
    for name in COURSE:
        for step in load_lesson(name).steps:
            assert all(told[name][step.title, claim.text]["sound"] for claim in step.claims), name


def test_a_page_that_waits_shows_the_recorded_run_of_the_first_lesson() -> None:
    assert json.loads(OPENING.read_text(encoding="utf-8")) == opening(FOLDER / f"{COURSE[0]}.json")


def test_what_is_recorded_is_of_the_lessons_as_they_are() -> None:
    """Recorded steps, plots and ghosts agree with the lessons, and a new computation gives the curve of one
    lesson again."""
    for name in COURSE:
        kept = json.loads((FOLDER / f"{name}.json").read_text(encoding="utf-8"))["steps"]
        for step, drawn in zip(load_lesson(name).steps, kept, strict=True):
            assert drawn["title"] == step.title
            assert [(plot["words"], plot["unit"]) for plot in drawn["plots"]] == [
                (signal.words, signal.unit) for signal in step.plots
            ]
            assert all(len(plot["curves"]) == 1 + (step.ghost is not None) for plot in drawn["plots"])
    lesson = load_lesson(QUICK)
    (kept, *_) = json.loads((FOLDER / f"{QUICK}.json").read_text(encoding="utf-8"))["steps"]
    now = plot(lesson.steps[0], 0, runs_of(lesson, lesson.steps[0]))
    assert now["curves"][0] == pytest.approx(kept["plots"][0]["curves"][0], rel=5e-3, abs=1e-6)


@SITE
@pytest.mark.parametrize(("width", "height"), [(1440, 900), (390, 844)])
@pytest.mark.parametrize("scheme", ["light", "dark"])
def test_the_site_in_a_browser(
    site: Path, browser: Browser, width: int, height: int, scheme: Literal["light", "dark"]
) -> None:
    """When pages are opened from a file, no page is wider than the screen or loads anything from another
    host, and film, answers and search work."""
    asked: list[str] = []
    page = browser.new_page(viewport={"width": width, "height": height}, color_scheme=scheme)
    page.set_default_timeout(SLOW)
    page.on("request", lambda request: asked.append(request.url))
    for name in ("index.html", "lessons/inside-the-qp.html"):
        page.goto((site / name).as_uri())
        assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert page.evaluate("document.querySelector('math[display=block]').getBoundingClientRect().height") > 10
    assert page.evaluate("document.querySelector('figure.curves svg').getBoundingClientRect().width") > 200
    answer = page.locator("details", has_text="Answer").last
    answer.locator("summary").click()
    assert answer.evaluate("each => each.open && each.innerText.length") > 60
    page.locator("button[data-film]").click()
    assert eventually(page, lambda: any("player.html" in each.url for each in page.frames))
    (frame,) = [each for each in page.frames if "player.html" in each.url]
    frame.wait_for_function(
        "() => window.__viserMutable?.nodeRefFromName['/robot/2'] && window.__VISER_EMBED_DATA__.length"
    )
    page.goto((site / "search.html").as_uri() + "?q=singularity")
    page.locator("#search-results li").first.wait_for()
    page.close()
    assert asked and all(url.startswith(("file:", "data:", "blob:")) for url in asked)


@SITE
def test_what_one_would_search_for_is_in_the_index(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    for word in ("hierarchi", "himpc.controllers.himpc", "previews", "convergence_gauge"):
        assert word in index


def test_a_quoted_number_is_still_so(tmp_path: Path) -> None:
    """The numbers of a lesson that pages quote agree with a new measurement, to the three digits that are
    printed."""
    told = measured(ROOT / MEASURED)[QUICK]
    path = tmp_path / "now.json"
    assert main(["lessons", "--check", QUICK, "--json", str(path)]) == 0
    (now,) = json.loads(path.read_text())["lessons"]
    for check in now["checks"]:
        if check["what"].startswith("[^"):
            continue  # a note; pages quote claims and predictions only
        then = told[check["step"], check["what"]]
        if check["measured"] is not None:
            assert then["measured"] == pytest.approx(check["measured"], rel=5e-3), check["what"]
