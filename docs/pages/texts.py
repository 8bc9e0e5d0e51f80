"""Pages made from the project's own texts, with links to the site's pages."""

from __future__ import annotations

import re
from pathlib import Path

IN_DOCS = (
    *("starting", "serving", "export", "authoring", "instructors"),
    *("disagreements", "settings", "results", "house"),
)
LINKS = {
    **{f"{where}{name}.md": f"{name}.md" for name in IN_DOCS for where in ("docs/", "")},
    "docs/lessons/README.md": "lessons/index.md",
    **{f"{where}CONTRIBUTING.md": "contributing.md" for where in ("", "../")},
    "examples/README.md": "examples/index.md",
    "README.md": "index.md",
    "CHANGELOG.md": "changelog.md",
}
"""The page of the site for each of the project's texts. Links between the texts in `docs/` contain the file
name only."""
FROM_README = {
    "start": ("Start", "Start"),
    "own": ("Bring your own", "Bring your own"),
    "own-program": ("In your own program", "In your own program"),
    "limits": ("Limits", "Limits"),
}
"""For each page: its title, and the section of the README that it contains."""


def pages(root: Path) -> dict[str, str]:
    """Returns the name and Markdown of each page."""
    readme = (root / "README.md").read_text(encoding="utf-8")
    found = {name: f"# {title}\n\n{section(readme, part)}" for name, (title, part) in FROM_README.items()}
    title, rest = found["start"].split("\n\n", 1)
    found["start"] = f"{title}\n\n{set_up(readme)}\n{rest}"
    found["start"] += "\n## What you can do\n\n" + section(readme, "What you can do")
    if "## Systems" in readme:
        found["start"] += "\n## Systems\n\n" + section(readme, "Systems")
    for name, file in (
        ("contributing", "CONTRIBUTING.md"),
        ("changelog", "CHANGELOG.md"),
        *((name, f"docs/{name}.md") for name in IN_DOCS),
    ):
        found[name] = (root / file).read_text(encoding="utf-8")
    citation = (root / "CITATION.cff").read_text(encoding="utf-8")
    found["cite"] = (
        f"# How to cite\n\nThis file is in the repository as `CITATION.cff`.\n\n```yaml\n{citation}```\n"
    )
    return {name: relinked(text) for name, text in found.items()}


def set_up(readme: str) -> str:
    """Returns the command that installs everything, from the README's first block of code."""
    return readme[readme.index("```sh") :].split("```\n", 1)[0] + "```\n"


def section(text: str, title: str) -> str:
    """Returns the text below a second-level heading. Raises ValueError if no heading has that title."""
    found = re.search(rf"^## {re.escape(title)}\n(.*?)(?=^## |\Z)", text, re.MULTILINE | re.DOTALL)
    if found is None:
        raise ValueError(f"no section '{title}' in the README")
    return found[1].strip() + "\n"


def relinked(text: str) -> str:
    """Replaces links to files of the repository by links to the site's pages; links to files without a page
    become plain text."""

    def turn(link: re.Match[str]) -> str:
        words, goal = link[1], link[2]
        if goal.startswith(("http://", "https://", "#")):
            return link[0]
        return f"[{words}]({LINKS[goal]})" if goal in LINKS else words

    return re.sub(r"(?<!!)\[([^\]]+)\]\(([^)\s]+)\)", turn, text)
