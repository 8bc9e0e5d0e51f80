"""Lesson texts as HTML: Markdown with equations in $…$ and $$…$$, and with explanations of the glossary's
words."""

from __future__ import annotations

import re
from collections.abc import Callable
from functools import lru_cache

from latex2mathml.converter import convert
from markdown_it import MarkdownIt

from app.html.glossary import explained
from app.html.text import formula

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
