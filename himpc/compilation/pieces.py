"""Compiles functions that only other compiled functions call: their intermediate code is linked into the
callers, and only the callers become machine code.

By default Numba optimises every function three times, generates machine code for it, and wraps it for callers
in Python and in C; then it does the same again for each caller, which contains the function.
"""

from __future__ import annotations

from abc import ABC
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Linking(JITCodeLibrary, ABC):
    """Code that refers to the code of every function that it calls, once each."""

    def add_linking_library(self, library: Any) -> None:
        """Adds a library whose functions this library calls."""
        # Callers are added first, because code that nothing refers to would not be linked.
        for each in (library, *library.called) if isinstance(library, _Loose) else (library,):
            if each not in self._linking_libraries:
                super().add_linking_library(each)


class _Linked(_Linking):
    """Code together with that of all functions that it calls."""


class _Loose(_Linking):
    """Code of one function, not optimised and without the functions that it calls, so that it cannot run
    alone."""

    @property
    def called(self) -> list[Any]:
        """The libraries of all functions that it calls, and of those that they call."""
        return self._linking_libraries

    def finalize(self) -> None:
        """Ends the addition of code."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Returns 0: this code cannot run alone and has no address."""
        return 0

    @property
    def codegen(self) -> Any:
        """The object whose `set_env` is called for the function's environment: this library, which ignores
        the call; `Whole` makes it later for all functions."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Does nothing: the code that would read the environment does not exist yet."""


class _Compiling(Compiler, ABC):
    """Base class of compilers for the two libraries above; `library` is the class of the library."""

    library: type[_Linking]

    def compile_extra(self, func: Any) -> Any:
        """Overrides Numba's entry point: sets the library."""
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class Whole(_Compiling):
    """Compiles a function that Python calls."""

    library = _Linked

    def compile_extra(self, func: Any) -> Any:
        """Overrides Numba's entry point: sets the addresses of all environments."""
        found = super().compile_extra(func)
        for each in found._find_referenced_environments():
            found.library.codegen.set_env(each.env_name, each)
        return found


class Piece(_Compiling):
    """Compiles a function that only compiled functions call."""

    library = _Loose


class Open(_Compiling):
    """Compiles a function for other targets than this processor: nothing is optimised or becomes machine
    code."""

    library = _Loose
