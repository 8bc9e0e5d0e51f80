"""What the documentation site adds to Sphinx: equations as MathML, docstrings as they are written; and what
saves a quarter of its time."""

from __future__ import annotations

import re
from typing import Any

from docutils import nodes
from latex2mathml.converter import convert
from sphinx.application import Sphinx
from sphinx.domains.python import ObjectEntry, PythonDomain
from sphinx.environment import BuildEnvironment

_CODE = re.compile(r"(``?[^`]+``?)")
_LABEL = re.compile(r"^(\s*)([*\w, ]+?)(:\s.*|:)$")
_SECTIONS = ("Args", "Attributes", "Returns", "Raises", "Yields")


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_html_math_renderer("mathml", (_inline, None), (_displayed, None))
    # Before napoleon, which reads the sections.
    app.connect("autodoc-process-docstring", _plain, priority=100)
    # Before the theme, which asks for the tree.
    app.connect("html-page-context", _titles_alone, priority=100)
    app.add_domain(Names, override=True)
    return {"parallel_read_safe": True, "parallel_write_safe": True}


class Names(PythonDomain):
    """Looks for a name of a signature once, since it looks through all there are."""

    def __init__(self, env: BuildEnvironment) -> None:
        super().__init__(env)
        self._found: dict[tuple[Any, ...], list[tuple[str, ObjectEntry]]] = {}

    def find_obj(
        self,
        env: BuildEnvironment,
        modname: str,
        classname: str,
        name: str,
        type: str | None,
        searchmode: int = 0,
    ) -> list[tuple[str, ObjectEntry]]:
        """What Sphinx finds while there are as many names."""
        key = (modname, classname, name, type, searchmode, len(self.objects))
        if key not in self._found:
            self._found[key] = super().find_obj(env, modname, classname, name, type, searchmode)
        return list(self._found[key])


def _titles_alone(app: Sphinx, page: str, template: str, context: dict[str, Any], doctree: Any) -> None:
    """The tree beside every page has the titles of pages: what stands on them need not be copied for it."""
    tree, known = context["toctree"], app.env.metadata
    leaves = app.env.found_docs - set(app.env.toctree_includes)

    def titles(**options: Any) -> str:
        if not options.get("titles_only"):
            return tree(**options)
        before = {name: dict(known[name]) for name in leaves}
        for name in leaves:
            known[name]["tocdepth"] = 1
        try:
            return tree(**options)
        finally:
            known.update(before)

    context["toctree"] = titles


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
