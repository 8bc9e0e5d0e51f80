"""The reference: a page per package with its public modules."""

from __future__ import annotations

import ast
from pathlib import Path

PACKAGES = {
    "robots": "What the robot is",
    "himpc": "How it is controlled",
    "lessons": "What is taught: scenes, runs, experiments",
}
INSIDE = (
    "himpc.compilation",
    "himpc.tick",
    "lessons.course",
    "lessons.papers",
    "lessons.examples",
    "lessons.plots",
)
"""Internal packages, which have no page."""


def pages(root: Path) -> dict[str, str]:
    """Returns the name and Markdown of each page and of their index."""
    found, names = {}, []
    for top, says in PACKAGES.items():
        by_package: dict[str, list[str]] = {}
        for path in sorted((root / top).rglob("*.py")):
            module = ".".join(path.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
            package = module if path.name == "__init__.py" else module.rpartition(".")[0]
            if not module.startswith(INSIDE) and documented(path):
                by_package.setdefault(package, []).append(module)
        for package, modules in sorted(by_package.items()):
            names.append(package)
            title = f"{package}: {says}" if package == top else package
            found[f"api/{package}"] = f"# {title}\n\n" + "\n".join(map(one, modules))
    listed = "\n".join(names)
    found["api/index"] = (
        "# Reference\n\nThe reference is made from the docstrings. Numbers of equations are those of the "
        "papers. Vectors are in Pinocchio's joint order, quantities in SI units, and angles in rad.\n\n"
        f"```{{toctree}}\n:maxdepth: 1\n\n{listed}\n```\n"
    )
    return found


def documented(path: Path) -> bool:
    """Returns whether a module defines a public class or function."""
    body = ast.parse(path.read_text(encoding="utf-8")).body
    kinds = (ast.ClassDef, ast.FunctionDef)
    return any(isinstance(node, kinds) and not node.name.startswith("_") for node in body)


def one(module: str) -> str:
    """Returns the section of a page about a module."""
    directive = f".. automodule:: {module}\n   :members:\n   :show-inheritance:"
    return f"## {module}\n\n```{{eval-rst}}\n{directive}\n```\n"
