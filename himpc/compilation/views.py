"""Array views for the compiled functions: parts of a larger array that the kernel's caller owns."""

from __future__ import annotations

from typing import Any

from himpc.compilation import public_only

if public_only():
    from himpc.compilation import public as chain
else:
    from himpc.compilation import private_views as chain

vector: Any = chain.vector
"""(data, start, n): a view of n numbers, from index start on."""
matrix: Any = chain.matrix
"""(data, start, rows, columns): the same as a matrix, row by row."""
matrices: Any = chain.matrices
"""(data, start, count, rows, columns): the same as several matrices, one after the other."""
borrowed: Any = chain.borrowed
"""(array): a view of the whole array."""
