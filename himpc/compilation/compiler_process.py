"""The program of the process that compiles, see `compiler`."""

from __future__ import annotations

import os
from importlib import import_module

from himpc.compilation.compiled import on_compiled
from himpc.compilation.compiling import compile_all
from robots.processes.orphans import end_with


def serve(module: str) -> None:
    """Imports a module, and reports every compiled function on standard output."""
    end_with(0)
    # A module may print text, which must not be mixed with the reports.
    with os.fdopen(os.dup(1), "w", buffering=1) as out:
        os.dup2(os.open(os.devnull, os.O_WRONLY), 1)
        with on_compiled(lambda name: print(name, file=out)):
            import_module(module)
            if module.startswith("himpc."):
                compile_all(lambda *_: None)
