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
"""`clock_gettime` of the C library: (clock, address of two integers for s and ns). Some systems lack it."""

inline_kernel = chain.inline_kernel
"""Compiles a function as a part of every `kernel` that calls it, in any module."""
always_inline_kernel = chain.always_inline_kernel
"""Like `inline_kernel`, but the function is always inlined. It is meant for functions with many array
arguments, which LLVM would otherwise pass through memory."""
kernel = chain.kernel
"""(*argument types): compiles a function, with every `inline_kernel` that the function calls, for arguments
of these types only. Compilation takes place when the function's module is first imported."""
on_compiled = chain.on_compiled
"""(tell): returns a context manager. In its context, `tell` is called with the dotted name of each function
that is compiled."""
intermediate = chain.intermediate
"""(function, argument types): returns the function and all functions that it calls as LLVM code in text form,
for targets other than this processor."""
kept = chain.kept
"""(function, key, make): returns bytes that depend on the function's sources. They are read from disk if an
earlier call has made them."""


def plain(function: Any) -> Any:
    """Returns the Python function of a kernel, to compile it in another way as well."""
    return getattr(function, "py_func", function)
