"""The Numba tool chain: functions are compiled once, stored on disk, and loaded with their module.

Other packages import `compiled` (decorators and types) and `views` (arrays); Numba is imported in this
package only. These two modules use one of two tool chains:

- the usual one, `private`, links all parts of a function into one piece of machine code, stores it in checked
  files and loads it without the compiler. It uses internal names of Numba, which a new release may change.
  These names occur only in `private`, `private_views`, `pieces` and `keeping`.
- with `HIMPC_LAB_NUMBA=public` in the environment, `public` uses `njit(cache=True)` alone. Both tool chains
  compute the same numbers to rounding. With `public`, compilation and each later start take longer, and the
  progress of compilation is not reported.
"""

import os
from collections.abc import Callable
from typing import Any

Function = Callable[..., Any]

OPTIONS: dict[str, Any] = {"error_model": "numpy", "fastmath": {"reassoc", "contract", "nsz"}}
"""Numba's options for arithmetic, which both tool chains use. Sums may be computed in any order. NaN and
infinity are supported. A division by zero raises no exception."""

SWITCH = "HIMPC_LAB_NUMBA"
"""Name of an environment variable; its value "public" selects the tool chain that uses Numba's documented
interface only."""


def public_only() -> bool:
    """Returns whether the environment selects Numba's public interface alone."""
    return os.environ.get(SWITCH) == "public"
