"""A page per example: its docstring and its program."""

from __future__ import annotations

import ast
from pathlib import Path


def pages(root: Path) -> dict[str, str]:
    """Returns the name and Markdown of each page and of their index."""
    found: dict[str, str] = {}
    rows: list[str] = []
    for path in sorted((root / "examples").glob("*.py")):
        text = path.read_text(encoding="utf-8")
        tree = ast.parse(text)
        told = ast.get_docstring(tree) or ""
        title, _, more = told.partition("\n")
        body = "\n".join(text.splitlines()[tree.body[0].end_lineno or 0 :]).strip()
        words = path.stem.replace("_", " ")
        found[f"examples/{path.stem}"] = (
            f"# {words[0].upper()}{words[1:]}\n\n{title}\n{more}\n\n`examples/{path.name}`\n\n"
            f"```python\n{body}\n```\n"
        )
        rows.append(f"| [{words}]({path.stem}.md) | {title} |")
    listed = "\n".join(path.rsplit("/", 1)[1] for path in found)
    found["examples/index"] = (
        "# Examples\n\nShort programs that use only the public interface; tests run all of them.\n\n"
        "| program | shows |\n|---|---|\n"
        + "\n".join(rows)
        + f"\n\n```{{toctree}}\n:hidden:\n\n{listed}\n```\n"
    )
    return found
