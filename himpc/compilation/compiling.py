"""Everything that is compiled, in one place: so that somebody can be told how far it is."""

from __future__ import annotations

import ast
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

_DOOR = "himpc.compilation.compiled"
_PACKAGE = Path(__file__).parents[1]


def compile_all(tell: Callable[[int, int], None]) -> None:
    """Loads every compiled function there is, and compiles those that are not on disk.

    Args:
        tell: called with (functions ready, of how many) after each that had to be compiled; never if all
            were on disk.
    """
    from himpc.compilation.compiled import on_compiled

    waiting = compiled_functions()
    total = sum(map(len, waiting.values()))
    ready: set[str] = set()

    def count(function: str) -> None:
        if any(function in names for names in waiting.values()):
            ready.add(function)
            tell(len(ready), total)

    with on_compiled(count):
        for module, names in waiting.items():
            import_module(module)
            ready |= names


def compiled_functions() -> dict[str, frozenset[str]]:
    """Dotted names of the functions that a decorator of `himpc.compilation.compiled` compiles, by module.
    Read from the sources: importing them is what takes long."""
    found = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        text = path.read_text()
        if _DOOR in text:
            module = ".".join((_PACKAGE.name, *path.relative_to(_PACKAGE).with_suffix("").parts))
            names = _decorated(ast.parse(text))
            if names:
                found[module] = frozenset(f"{module}.{name}" for name in names)
    return found


def _decorated(tree: ast.Module) -> list[str]:
    """Functions of a module with a decorator that comes from the door."""
    imported = {
        alias.asname or alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module == _DOOR
        for alias in node.names
    }
    return [
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(_called(decorator) in imported for decorator in node.decorator_list)
    ]


def _called(decorator: ast.expr) -> str:
    function = decorator.func if isinstance(decorator, ast.Call) else decorator
    return function.id if isinstance(function, ast.Name) else ""
