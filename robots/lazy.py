"""Lazy packages: all public names are visible, and the module of a name is imported on first use (PEP
562)."""

from __future__ import annotations

import sys
from collections.abc import Callable, Mapping
from importlib import import_module
from typing import Any


def lazily(package: str, homes: Mapping[str, str]) -> Callable[[str], Any]:
    """Returns the `__getattr__` of a package that imports the module of a name on first use.

    Args:
        package: dotted name of the package.
        homes: for each public name the dotted path of its module, relative to the package; a leading dot
            means the parent package.
    """

    def find(name: str) -> Any:
        if name not in homes:
            raise AttributeError(f"module '{package}' has no attribute '{name}'")
        value = getattr(import_module(f".{homes[name]}", package), name)
        setattr(sys.modules[package], name, value)
        return value

    return find
