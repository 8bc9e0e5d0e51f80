"""How Numba compiles functions that only other compiled functions call: their code is linked into these, and
becomes machine code there.

Left to itself Numba optimises every function three times, makes machine code of it, and wraps it for callers
in Python and in C; then it does so again, along with each caller, up to the top.
"""

from __future__ import annotations

from abc import ABC
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Linking(JITCodeLibrary, ABC):
    """Code that names the code of all pieces it calls, each of them once."""

    def add_linking_library(self, library: Any) -> None:
        """A library whose functions this one calls."""
        # Callers first: what nobody refers to yet would not be linked.
        for each in (library, *library.called) if isinstance(library, _Loose) else (library,):
            if each not in self._linking_libraries:
                super().add_linking_library(each)


class _Linked(_Linking):
    """Code together with that of its pieces."""


class _Loose(_Linking):
    """Code of one piece, not optimised and without what it calls: nobody can run it as it is."""

    @property
    def called(self) -> list[Any]:
        """The libraries of all functions that it calls, and of those that they call."""
        return self._linking_libraries

    def finalize(self) -> None:
        """Nothing is added any more."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """There is none."""
        return 0

    @property
    def codegen(self) -> Any:
        """Who is told where the function's environment is: `Whole` tells it."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Nothing: what would look there is not yet."""


class _Compiling(Compiler, ABC):
    """Compiles into a library of our own."""

    library: type[_Linking]

    def compile_extra(self, func: Any) -> Any:
        """Numba's entry point."""
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class Whole(_Compiling):
    """Compiles a function that Python calls."""

    library = _Linked

    def compile_extra(self, func: Any) -> Any:
        """Numba's entry point."""
        found = super().compile_extra(func)
        for each in found._find_referenced_environments():
            found.library.codegen.set_env(each.env_name, each)
        return found


class Piece(_Compiling):
    """Compiles a function that only compiled functions call. Python must not: there is no code to run."""

    library = _Loose

    def compile_extra(self, func: Any) -> Any:
        """Numba's entry point."""
        if not len(self.state.typingctx.callstack):
            raise TypeError(f"{func.__qualname__} is a piece of compiled functions: nobody else can call it")
        return super().compile_extra(func)
