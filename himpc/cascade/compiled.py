"""The door to Numba: functions compiled when their module is first imported."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from numba import boolean, float64, intp, njit

NUMBER, WHOLE, FLAG = float64, intp, boolean
VECTOR, MATRIX, MATRICES, FRAMES = float64[::1], float64[:, ::1], float64[:, :, ::1], float64[:, :, :, ::1]
INDICES, FLAGS = intp[::1], boolean[:, ::1]
"""Arrays of our own, contiguous."""
GIVEN, GIVEN_MATRIX, GIVEN_MATRICES = float64[:], float64[:, :], float64[:, :, :]
GIVEN_INDICES = intp[:]
"""What others hand over: it may be a slice."""

inner = njit(cache=True)
"""Compiles a function along with those `compiled` that call it; they stand below it."""


def compiled(*arguments: Any) -> Callable[[Callable[..., Any]], Any]:
    """Compiles a function for arguments of these types, and for no others.

    Left to the first call, each layout of an array that turns up would stop a running robot for the seconds
    that its compilation takes.
    """

    def compile_now(function: Callable[..., Any]) -> Any:
        fast = inner(function)
        fast.compile(arguments)
        fast.disable_compile()
        return fast

    return compile_now
