"""The glossary of the lab, and the functions that explain its words within a text."""

from __future__ import annotations

import re
import tomllib
from functools import cache
from html import escape
from importlib.resources import files

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
