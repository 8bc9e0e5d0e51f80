"""Compiles all functions, and reports the progress; the program of the process that compiles."""

from __future__ import annotations

import ast
import gc
import os
from collections.abc import Callable
from importlib import import_module
from pathlib import Path

from himpc.compilation.compiler import started
from robots.processes.orphans import end_with

_DOOR = "himpc.compilation.compiled"
_PACKAGE = Path(__file__).parents[1]
LARGEST = "himpc.tick.kernel.control_period"
"""The module with the function whose compilation takes as long as that of all others. It is loaded after
them: another process may compile it meanwhile, see `serve`."""


def compile_all(tell: Callable[[int, int], None]) -> None:
    """Loads all compiled functions, and compiles those that are not on disk.

    Args:
        tell: called with (number of compiled functions, number of all functions) after each compilation; not
            called if all functions were on disk.
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
        for module in sorted(waiting, key=lambda name: name == LARGEST or ".export." in name):
            import_module(module)
            ready |= waiting[module]


def serve(module: str, only_needed: bool = False) -> None:
    """The program of a process that `compiler.started` starts. It compiles, and reports every compiled
    function on standard output: for a module of this package all functions of the package, where a second
    process compiles the largest one; with `only_needed`, or for another module, only those that the module
    needs."""
    from himpc.compilation.compiled import on_compiled

    end_with(0)
    gc.disable()  # most of the compiler's objects are needed to the end; looking for others takes long
    # A module may print text, which must not be mixed with the reports.
    with os.fdopen(os.dup(1), "w", buffering=1) as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        with on_compiled(lambda name: print(name, file=out)):
            if only_needed or not module.startswith("himpc."):
                import_module(module)
                return
            with started(LARGEST, out.fileno(), only_needed=True) as largest:
                try:
                    compile_all(lambda *_: None)
                finally:
                    largest.kill()  # its code is on disk, or could not be stored


def compiled_functions() -> dict[str, frozenset[str]]:
    """Returns, for each module, the dotted names of the functions that have a decorator of
    `himpc.compilation.compiled`. They are read from the sources, because importing the modules takes long."""
    functions = {}
    for path in sorted(_PACKAGE.rglob("*.py")):
        text = path.read_text()
        if _DOOR in text:
            module = ".".join((_PACKAGE.name, *path.relative_to(_PACKAGE).with_suffix("").parts))
            names = _decorated(ast.parse(text))
            if names:
                functions[module] = frozenset(f"{module}.{name}" for name in names)
    return functions


def _decorated(tree: ast.Module) -> list[str]:
    """Returns the functions of a module whose decorator is imported from `himpc.compilation.compiled`, also
    those that are given to a call of the decorator: `other_name = decorator(name)`."""
    imported = {
        alias.asname or alias.name
        for node in tree.body
        if isinstance(node, ast.ImportFrom) and node.module == _DOOR
        for alias in node.names
    }
    decorated = [
        node.name
        for node in tree.body
        if isinstance(node, ast.FunctionDef)
        and any(_called(decorator) in imported for decorator in node.decorator_list)
    ]
    given = [
        argument.id
        for node in tree.body
        if isinstance(node, ast.Assign)
        and isinstance(node.value, ast.Call)
        and _called(node.value) in imported
        for argument in node.value.args
        if isinstance(argument, ast.Name)
    ]
    return decorated + given


def _called(decorator: ast.expr) -> str:
    function = decorator.func if isinstance(decorator, ast.Call) else decorator
    return function.id if isinstance(function, ast.Name) else ""
