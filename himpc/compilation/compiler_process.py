"""The program of the process that compiles, see `compiler`."""

from __future__ import annotations

import os
from importlib import import_module

from himpc.compilation.compiled import on_compiled
from himpc.compilation.compiler import started
from himpc.compilation.compiling import LARGEST, compile_all
from robots.processes.orphans import end_with


def serve(module: str, only_needed: bool = False) -> None:
    """Compiles, and reports every compiled function on standard output: for a module of this package all
    functions of the package, where a second process compiles the largest one; with `only_needed`, or for
    another module, only those that the module needs."""
    end_with(0)
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
