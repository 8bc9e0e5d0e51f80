"""Loads a compiled function from disk without starting the compiler.

When a function is requested, Numba first prepares its compiler: it reads Numba's definitions of NumPy's
functions, and imports SciPy. This preparation takes a third of a second in every process. It is not needed if
the machine code is on disk.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler_lock import global_compiler_lock
from numba.core.runtime.nrt import rtsys


def load(function: Any, arguments: tuple[Any, ...]) -> bool:
    """Loads the machine code of a function for arguments of these types, and returns whether it was on
    disk."""
    with global_compiler_lock:
        rtsys.initialize(function.targetctx)  # functions that the machine code calls
        overload = function._cache.load_overload(arguments, function.targetctx)
        if overload is None:
            return False
        function._cache_hits[arguments] += 1
        function.targetctx.insert_user_function(overload.entry_point, overload.fndesc, [overload.library])
        function.add_overload(overload)
        return True
