"""Array views for the compiled functions. A view is a part of a larger array, which the kernel's caller
owns."""

from __future__ import annotations

from typing import Any, get_type_hints

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

arrays_in: Any = chain.arrays_in
"""(table, numbers, wholes): returns a function (data, where, whole, whole_where, s) that returns all arrays
of a table as views. `table` is the class with the arrays' names; numbers and wholes contain the shapes of its
arrays of real and of whole numbers by name, see `shapes_of`; `where` and `whole_where` contain the index at
which each array begins in `data` and in `whole`; s contains the values of the letters in the shapes."""


def shapes_of(table: type, kind: Any) -> dict[str, str]:
    """Returns the shapes of a table's arrays of one kind, by name. Each annotation of the table is
    Annotated[kind, shape, …]."""
    hints = get_type_hints(table, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if hint.__origin__ == kind}
