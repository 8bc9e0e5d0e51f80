"""The Numba tool chain: functions are compiled once, kept on disk, and loaded with their module.

Everybody imports `compiled` (decorators and types) and `views` (arrays); Numba is imported here only. Behind
these two stand two tool chains:

- the usual one, `private`, links all parts of a function into one piece of machine code, keeps it in checked
  files and loads it without the compiler. It uses names of Numba that a new release may change: those in
  `private`, `private_views`, `pieces`, `keeping` and `loading`.
- with `HIMPC_LAB_NUMBA=public` in the environment, `public` is all there is: `njit(cache=True)`. The numbers
  agree to rounding; compiling takes longer, each later start as well, and nothing tells how far it is.
"""

import os

SWITCH = "HIMPC_LAB_NUMBA"
"""In the environment; "public": nothing but what Numba documents is used."""


def public_only() -> bool:
    """Whether the environment asks for Numba's public interface alone."""
    return os.environ.get(SWITCH) == "public"
