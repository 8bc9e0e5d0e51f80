"""Lesson texts as HTML: Markdown with equations in $…$ and $$…$$, and with explanations of the glossary's
words."""

from __future__ import annotations

import re
import tomllib
from collections.abc import Callable
from functools import cache, lru_cache
from html import escape
from importlib.resources import files

from latex2mathml.converter import convert
from markdown_it import MarkdownIt

from app.html.text import formula

STYLE = (
    "<style>abbr.word{text-decoration:underline dotted;text-underline-offset:0.2em;cursor:help}"
    "abbr.word:focus::after{content:' (' attr(title) ') ';font-style:italic;opacity:0.8}</style>"
)
"""A hint appears under the mouse pointer. On devices without a pointer, a tap or the Tab key inserts the hint
into the text."""

_TAG = re.compile(r"(<[^>]*>)")
_CLOSED = ("math", "code", "pre", "abbr", "svg", "style")


@cache
def words() -> dict[str, str]:
    """Returns every word of the glossary with its explanation."""
    return {word: str(entry["means"]) for word, entry in _entries().items()}


@cache
def _entries() -> dict[str, dict[str, object]]:
    return tomllib.loads((files("app.html") / "glossary.toml").read_text(encoding="utf-8"))


@cache
def _forms() -> tuple[re.Pattern[str], dict[str, str]]:
    """Returns a pattern that matches all spellings, and the word of the glossary for each spelling."""
    of: dict[str, str] = {}
    for word, entry in _entries().items():
        forms = entry.get("forms", [word])
        assert isinstance(forms, list)
        of.update(dict.fromkeys(map(str, forms), word))
    longest_first = sorted(of, key=len, reverse=True)
    return re.compile(rf"(?<!\w)({'|'.join(map(re.escape, longest_first))})(?!\w)"), of


def explained(html: str) -> str:
    """Returns the HTML with an explanation at the first use of every word of the glossary."""
    pattern, of = _forms()
    seen: set[str] = set()

    def explain(found: re.Match[str]) -> str:
        word = of[found[1]]
        if word in seen:
            return found[1]
        seen.add(word)
        return f'<abbr class="word" tabindex="0" title="{escape(words()[word])}">{found[1]}</abbr>'

    inside = 0
    pieces = _TAG.split(html)
    for place, piece in enumerate(pieces):
        if place % 2 == 0:
            pieces[place] = pattern.sub(explain, piece) if inside == 0 else piece
        elif piece[1:].lstrip("/").split(" ")[0].rstrip(">") in _CLOSED:
            inside += -1 if piece.startswith("</") else 0 if piece.endswith("/>") else 1
    return "".join(pieces)


_MARKDOWN = MarkdownIt("commonmark", {"html": False})
_EQUATION = re.compile(r"\$\$(.+?)\$\$([.,;]?)|\$(.+?)\$", re.S)
_ALONE = re.compile(r"<p>(\ue000\d+\ue001)</p>")
_PLACE = re.compile(r"\ue000(\d+)\ue001")
_SENTENCE = re.compile(r"[.!?][*_`\")”$]*\s+(?=[^a-z\s$]|\$[^$])")


def word_count(text: str) -> int:
    """Returns the number of words of a text. An equation counts as one word, a number as none."""
    return sum(any(map(str.isalpha, word)) for word in _EQUATION.sub("equation", text).split())


def split(text: str, most: int) -> tuple[str, str]:
    """Returns the first sentences of a text, at least one and at most `most` words, and the rest."""
    inside = [found.span() for found in _EQUATION.finditer(text)]
    ends = [
        found.end()
        for found in _SENTENCE.finditer(text)
        if not any(low < found.start() < high - 1 for low, high in inside)
    ] + [len(text)]
    end = max((end for end in ends if word_count(text[:end]) <= most), default=ends[0])
    return text[:end].rstrip(), text[end:]


@lru_cache(maxsize=256)
def rendered(text: str) -> str:
    """Returns HTML of paragraphs. HTML tags in the text are shown as text."""
    return _html(text, _MARKDOWN.render)


@lru_cache(maxsize=256)
def rendered_line(text: str) -> str:
    """Returns HTML of a text that is part of a line."""
    return _html(text, _MARKDOWN.renderInline)


def _html(text: str, render: Callable[[str], str]) -> str:
    equations: list[str] = []

    def keep(found: re.Match[str]) -> str:
        # Markdown would interpret underscores and backslashes of an equation.
        display, inline = found[1], found[3]
        equations.append(formula(display.strip()) if display else convert(" ".join(inline.split())))
        return f"\ue000{len(equations) - 1}\ue001{found[2] or ''}"

    html = render(_EQUATION.sub(keep, text))
    html = _ALONE.sub(r"\1", explained(html))  # HTML does not allow a block within a paragraph
    return _PLACE.sub(lambda found: equations[int(found[1])], html)
