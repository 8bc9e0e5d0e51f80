"""The interface to Numba: decorators for compiled functions, and the types of their arguments."""

from __future__ import annotations

from typing import Any

from numba import boolean, float64, int64, intp, types

from himpc.compilation import public_only

if public_only():
    from himpc.compilation import public as chain
else:
    from himpc.compilation import private as chain

NUMBER, WHOLE, FLAG = float64, intp, boolean
VECTOR, MATRIX, MATRICES = float64[::1], float64[:, ::1], float64[:, :, ::1]
INDICES, TABLE, FLAGS = intp[::1], int64[:, ::1], boolean[:, ::1]
"""Contiguous arrays that this package allocates."""
FIXED, FIXED_VECTOR = types.Array(float64, 2, "C", readonly=True), types.Array(float64, 1, "C", readonly=True)
"""Read-only contiguous arrays that this package allocates."""
GIVEN_VECTOR = types.Array(float64, 1, "A", readonly=True)
GIVEN_MATRIX, GIVEN_MATRICES = float64[:, :], float64[:, :, :]
"""Arrays from callers, which may be slices."""

clock_gettime: Any = types.ExternalFunction("clock_gettime", types.int32(types.int32, types.uintp))
"""`clock_gettime` of the C library, if it has one: (clock, address of two whole numbers for s and ns)."""

inline_kernel = chain.inline_kernel
"""Compiles a function as a part of every `kernel` that calls it, in any module."""
always_inline_kernel = chain.always_inline_kernel
"""The same for a function with many array arguments, which is always inlined; otherwise LLVM would pass all
arrays through memory."""
kernel = chain.kernel
"""(*argument types): compiles a function, with every `inline_kernel` that it calls, when its module is first
imported, for arguments of these types only."""
on_compiled = chain.on_compiled
"""(tell): a context; while it is open, `tell` is called with the dotted name of each function that is
compiled."""
intermediate = chain.intermediate
"""(function, argument types): the function and all that it calls as LLVM's text, for targets other than this
processor."""
kept = chain.kept
"""(function, key, make): bytes that depend on the function's sources, from disk if they have been made
before."""
