"""Builds the documentation site: `python -m docs.build [--out out/site]`.

Each build makes all pages anew. The lessons are made from the course, the reference from docstrings, the
examples from their files, and the other pages from README, CONTRIBUTING and docs/. Every warning is an error.
The site is static and needs no server: open index.html. With Node and the extra `export`, the site has live
figures and the page try.html. Without them, it has recordings only.
"""

from __future__ import annotations

import argparse
import shutil
import sys
from pathlib import Path

from docs import films
from docs.figures import front
from docs.pages import api, examples, exercises, lessons, texts
from docs.record import FOLDER
from lessons.course import COURSE, load_lesson

ROOT = Path(__file__).parents[1]


def write_sources(folder: Path, live: bool) -> None:
    """Writes the sources of all pages for Sphinx; live: whether the pages have live figures."""
    shutil.rmtree(folder, ignore_errors=True)
    shutil.copytree(ROOT / "docs" / "site", folder, ignore=shutil.ignore_patterns("__pycache__", "*.json"))
    pages: dict[str, str] = {}
    for kind in (texts, exercises, examples, api):
        pages |= kind.pages(ROOT)
    pages |= lessons.pages(ROOT, live)
    index = folder / "index.md"
    index.write_text(with_live(index.read_text(encoding="utf-8"), live), encoding="utf-8")
    for name, text in pages.items():
        path = folder / f"{name}.md"
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")
    for name in ("page.webp", "robots.webp"):
        shutil.copy(ROOT / "docs" / name, folder / name)
    for picture in sorted((ROOT / "docs" / "lessons").glob("*.webp")):
        shutil.copy(picture, folder / "lessons" / picture.name)


def with_live(text: str, live: bool) -> str:
    """Returns the first page with the link to *Try it*, or with a sentence that says why the site has no such
    page."""
    return text.replace("@try@", front.INVITATION if live else front.WITHOUT)


def write_films(folder: Path) -> None:
    """Writes the 3D player and one recorded scene per lesson next to the built pages, without Sphinx."""
    folder.mkdir(parents=True)
    (folder / "player.html").write_text(films.player(), encoding="utf-8")
    for name in COURSE:
        motion = films.motion_of(FOLDER / f"{name}.json")
        (folder / f"{name}.js").write_text(films.film(load_lesson(name), motion), encoding="utf-8")


def build(out: Path, live: bool = True) -> int:
    """Builds the site, with live figures if they are wanted and possible, and returns Sphinx's exit code."""
    from sphinx.cmd.build import build_main

    source = out.parent / f"{out.name}-source"
    missing = front.missing() if live else None
    if missing:
        print(missing, file=sys.stderr)
    live = live and missing is None
    write_sources(source, live)
    shutil.rmtree(out, ignore_errors=True)
    sys.path.insert(0, str(ROOT))
    write_films(out / "films")
    if live:
        front.write(out)
    return build_main(
        ["-q", "-W", "--keep-going", "-b", "html", "-d", str(source / "_build"), str(source), str(out)]
    )


def main() -> int:
    """Builds the site in the folder that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--out", type=Path, default=ROOT / "out" / "site")
    out = parser.parse_args().out.resolve()
    code = build(out)
    print(f"{out / 'index.html'}" if code == 0 else "the site was not built", file=sys.stderr)
    return code


if __name__ == "__main__":
    sys.exit(main())
