"""The door to Numba: decorators of what is compiled, and the types of its arguments."""

from __future__ import annotations

from numba import boolean, float64, int64, intp, types

from himpc.compilation import public_only

if public_only():
    from himpc.compilation import public as chain
else:
    from himpc.compilation import private as chain

NUMBER, WHOLE, FLAG = float64, intp, boolean
VECTOR, MATRIX, MATRICES = float64[::1], float64[:, ::1], float64[:, :, ::1]
INDICES, TABLE, FLAGS = intp[::1], int64[:, ::1], boolean[:, ::1]
"""Arrays of our own, contiguous."""
FIXED, FIXED_VECTOR = types.Array(float64, 2, "C", readonly=True), types.Array(float64, 1, "C", readonly=True)
"""The same, not to be written to."""
GIVEN_VECTOR = types.Array(float64, 1, "A", readonly=True)
GIVEN_MATRIX, GIVEN_MATRICES = float64[:, :], float64[:, :, :]
"""What others hand over: it may be a slice."""

inline_kernel = chain.inline_kernel
"""Compiles a function as a part of every `kernel` that calls it, wherever that stands."""
always_inline_kernel = chain.always_inline_kernel
"""The same for a function of many arrays: LLVM, left to itself, would pass all of them through memory."""
kernel = chain.kernel
"""(*argument types): compiles a function, with every `inline_kernel` that it calls, for arguments of these
types, and for no others, when its module is first imported."""
on_compiled = chain.on_compiled
"""(tell): while this context is open, `tell` hears the dotted names of functions that had to be compiled."""
