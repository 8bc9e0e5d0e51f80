"""The documentation site: built without a warning, complete, its links whole, nothing loaded from others."""

from __future__ import annotations

import json
import re
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

import pytest

from app.__main__ import main
from docs.build import build
from docs.pages.lessons import MEASURED, measured
from lessons.course import COURSE, load_lesson

ROOT = Path(__file__).parents[1]
pytestmark = pytest.mark.filterwarnings("ignore::DeprecationWarning", "ignore::PendingDeprecationWarning")
QUICK = "one-task"
"""A lesson whose numbers are measured again here."""


class Parts(HTMLParser):
    """What a page links to, what it loads, and its anchors."""

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


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Built by the command's own function; every warning would be an error."""
    out = tmp_path_factory.mktemp("docs") / "site"
    assert build(out) == 0
    return out


def test_every_link_leads_somewhere(site: Path) -> None:
    """Pages, anchors and pictures; from a file as from a server, since all are relative."""
    pages = {path: Parts(path.read_text(encoding="utf-8")) for path in site.rglob("*.html")}
    assert len(pages) > 60
    for path, parts in pages.items():
        for link in (*parts.links, *parts.loads):
            goal = urlsplit(link)
            if goal.scheme:
                assert link in parts.links, f"{path.name} loads {link}"
                continue
            target = (path.parent / unquote(goal.path)).resolve() if goal.path else path
            assert target.exists(), f"{path.relative_to(site)} leads to {link}"
            if goal.fragment and target in pages:
                assert unquote(goal.fragment) in pages[target].anchors, f"{path.name} leads to {link}"


def test_styles_load_nothing_from_elsewhere(site: Path) -> None:
    for path in site.rglob("*.css"):
        assert not re.search(r"(?:url\(|@import)\s*['\"]?(?:https?:)?//", path.read_text(encoding="utf-8")), (
            path
        )


def test_every_lesson_is_a_page(site: Path) -> None:
    """With its steps, its claims and equations that a browser draws by itself."""
    text = ""
    for name in COURSE:
        text = (site / "lessons" / f"{name}.html").read_text(encoding="utf-8")
        for step in load_lesson(name).steps:
            assert step.title.split(" $")[0] in re.sub(r"&#x27;|’", "'", text)
        assert text.count("<table") > len(load_lesson(name).steps) - 1
    assert "<math" in text


def test_what_one_would_search_for_is_in_the_index(site: Path) -> None:
    index = (site / "searchindex.js").read_text(encoding="utf-8")
    for word in ("hierarchi", "himpc.controllers.himpc", "previews", "convergence_gauge"):
        assert word in index


def test_a_quoted_number_is_still_so(tmp_path: Path) -> None:
    """What pages quote of a lesson is what the lesson measures now, to the three digits that are printed."""
    told = measured(ROOT / MEASURED)[QUICK]
    path = tmp_path / "now.json"
    assert main(["lessons", "--check", QUICK, "--json", str(path)]) == 0
    (now,) = json.loads(path.read_text())["lessons"]
    for check in now["checks"]:
        then = told[check["step"], check["what"]]
        if check["measured"] is not None:
            assert then["measured"] == pytest.approx(check["measured"], rel=5e-3), check["what"]
