"""Compiles functions that are called only by other compiled functions. Their intermediate code is linked into
the callers, and machine code is generated only for the callers.

By default Numba optimises every function three times, generates machine code for it, and adds wrappers for
callers in Python and in C. The code of each caller contains the function, and Numba repeats all this work for
each caller.
"""

from __future__ import annotations

from abc import ABC
from typing import Any

from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler


class _Linking(JITCodeLibrary, ABC):
    """Code of a function with one reference to the code of each function that it calls."""

    def add_linking_library(self, library: Any) -> None:
        """Adds a library whose functions this library calls."""
        # Callers are added first, because code that nothing refers to would not be linked.
        for piece in (library, *library.called) if isinstance(library, _Loose) else (library,):
            if piece not in self._linking_libraries:
                super().add_linking_library(piece)


class _Linked(_Linking):
    """Code of one function, linked with the code of all functions that it calls."""


class _Loose(_Linking):
    """Code of one function, not optimised and without the code of the functions that it calls, so that it
    cannot run alone."""

    @property
    def called(self) -> list[Any]:
        """The libraries of all functions that this function calls, directly or through others."""
        return self._linking_libraries

    def finalize(self) -> None:
        """Marks the library as complete: no code can be added afterwards."""
        self._raise_if_finalized()
        self._finalize_dynamic_globals()
        self._finalized = True

    def get_pointer_to_function(self, name: str) -> int:
        """Returns 0: this code cannot run alone and has no address."""
        return 0

    @property
    def codegen(self) -> Any:
        """The object whose `set_env` Numba calls with the function's environment. It is this library, which
        ignores the call; `LinkedCompiler` sets the environments of all functions later."""
        return self

    def set_env(self, name: str, environment: Any) -> None:
        """Does nothing. The code that reads the environment is generated later."""


class _Compiling(Compiler, ABC):
    """Base class of compilers for the two libraries above; `library` is the class of the library."""

    library: type[_Linking]

    def compile_extra(self, func: Any) -> Any:
        """Overrides Numba's entry point, to set the library."""
        self.state.library = self.library(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class LinkedCompiler(_Compiling):
    """Compiles a function that Python calls."""

    library = _Linked

    def compile_extra(self, func: Any) -> Any:
        """Overrides Numba's entry point, to set the addresses of all environments as well."""
        compiled = super().compile_extra(func)
        for environment in compiled._find_referenced_environments():
            compiled.library.codegen.set_env(environment.env_name, environment)
        return compiled


class Piece(_Compiling):
    """Compiles a function that only compiled functions call."""

    library = _Loose


class Open(_Compiling):
    """Compiles a function for other targets than this processor: the code is not optimised, and no machine
    code is generated."""

    library = _Loose
