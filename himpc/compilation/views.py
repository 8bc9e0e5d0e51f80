"""Array views for the compiled functions. A view is a part of a larger array, which the kernel's caller
owns."""

from __future__ import annotations

from typing import Any

from himpc.compilation import public_only

if public_only():
    from himpc.compilation import public as chain
else:
    from himpc.compilation import private_views as chain

vector: Any = chain.vector
"""(data, start, n): returns a view of n numbers; the first has the index `start`."""
matrix: Any = chain.matrix
"""(data, start, rows, columns): returns a view of a matrix, which is stored row by row."""
matrices: Any = chain.matrices
"""(data, start, count, rows, columns): returns a view of several matrices, stored one after the other."""
borrowed: Any = chain.borrowed
"""(array): returns a view of the whole array."""
