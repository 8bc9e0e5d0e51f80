"""What the documentation site adds to Sphinx: equations as MathML, docstrings as they are written."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx

_CODE = re.compile(r"(``?[^`]+``?)")
_LABEL = re.compile(r"^(\s*)([*\w, ]+?)(:\s.*|:)$")
_SECTIONS = ("Args", "Attributes", "Returns", "Raises", "Yields")


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    # Before napoleon, which reads the sections.
    app.connect("autodoc-process-docstring", _plain, priority=100)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


def _inline(translator: Any, node: nodes.math) -> None:
    translator.body.append(convert(node.astext()))
    raise nodes.SkipNode


def _displayed(translator: Any, node: nodes.math_block) -> None:
    translator.body.append(convert(node.astext(), display="block"))
    raise nodes.SkipNode


def _plain(app: Sphinx, what: str, name: str, obj: object, options: object, lines: list[str]) -> None:
    """Docstrings here are plain words with `code`; to Sphinx many of their signs would mean something."""
    section = ""
    for k, line in enumerate(lines):
        if line.strip().rstrip(":") in _SECTIONS and line.endswith(":"):
            section = line.strip().rstrip(":")
            continue
        label = _LABEL.match(line) if section in ("Args", "Attributes", "Raises") else None
        if label is None:
            lines[k] = safe(line)
        else:
            lines[k] = f"{label[1]}{label[2]}{safe(label[3])}"


def safe(text: str) -> str:
    """A line whose words mean nothing to reStructuredText, but for its code."""
    parts = _CODE.split(text)
    for k, part in enumerate(parts):
        if k % 2:
            # Code must not touch a word.
            after = "\\ " if re.match(r"\w", parts[k + 1]) else ""
            before = "\\ " if re.search(r"\w$", parts[k - 1]) else ""
            parts[k] = f"{before}``{part.strip('`').strip()}``{after}"
        else:
            parts[k] = re.sub(r"([\\*|_`])", r"\\\1", part)
    return "".join(parts)
