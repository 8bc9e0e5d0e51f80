"""Lazy packages: all public names are visible, and the module of a name is imported on first use (PEP
562)."""

from __future__ import annotations

import ast
import sys
from collections.abc import Callable
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any


def lazily(package: str) -> Callable[[str], Any]:
    """Returns the `__getattr__` of a package that imports the module of a name on first use. The package
    names the modules in its imports under `if TYPE_CHECKING:`, and this is the only place that names them.

    Args:
        package: dotted name of the package.
    """

    def find(name: str) -> Any:
        homes = _homes(package)
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(import_module(homes[name]), name)
        setattr(sys.modules[package], name, value)
        return value

    return find


@cache
def _homes(package: str) -> dict[str, str]:
    """Returns, for each name that a package imports for types only, the dotted name of its module."""
    source = Path(str(sys.modules[package].__file__)).read_text(encoding="utf-8")
    for_types = [node for node in ast.parse(source).body if isinstance(node, ast.If)]
    imports = [node for branch in for_types for node in branch.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: str(node.module) for node in imports for alias in node.names}
