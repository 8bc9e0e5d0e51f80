"""How a compiled function comes from disk without the compiler.

Asked for a function, Numba first gets ready to compile it: it reads what each of NumPy's functions becomes,
and imports SciPy. That is a third of a second in every process, for nothing where machine code lies on disk.
"""

from __future__ import annotations

from typing import Any

from numba.core.compiler_lock import global_compiler_lock
from numba.core.runtime.nrt import rtsys


def load(function: Any, arguments: tuple[Any, ...]) -> bool:
    """Whether a function for arguments of these types was on disk. If so, it is now called for them."""
    with global_compiler_lock:
        rtsys.initialize(function.targetctx)  # what machine code calls
        found = function._cache.load_overload(arguments, function.targetctx)
        if found is None:
            return False
        function._cache_hits[arguments] += 1
        function.targetctx.insert_user_function(found.entry_point, found.fndesc, [found.library])
        function.add_overload(found)
        return True
