"""Arrays as the compiled functions see them: parts of a larger one, which the kernel's caller keeps."""

from __future__ import annotations

from typing import Any

from himpc.compilation import public_only

if public_only():
    from himpc.compilation import public as chain
else:
    from himpc.compilation import private_views as chain

vector: Any = chain.vector
"""(data, start, n): n numbers from a place on."""
matrix: Any = chain.matrix
"""(data, start, rows, columns): the same, row by row."""
matrices: Any = chain.matrices
"""(data, start, count, rows, columns): the same, matrix by matrix."""
borrowed: Any = chain.borrowed
"""(array): the whole."""
