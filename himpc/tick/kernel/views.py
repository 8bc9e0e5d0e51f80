"""Arrays of an arena, as the compiled functions see them."""

from __future__ import annotations

from typing import Any

from himpc.cascade.compiled import borrowed, piece


@piece
def vector(data: Any, start: int, n: int) -> Any:
    """n numbers."""
    return borrowed(data)[start : start + n]


@piece
def matrix(data: Any, start: int, rows: int, columns: int) -> Any:
    """(rows, columns)."""
    return borrowed(data)[start : start + rows * columns].reshape(rows, columns)


@piece
def matrices(data: Any, start: int, count: int, rows: int, columns: int) -> Any:
    """(count, rows, columns)."""
    return borrowed(data)[start : start + count * rows * columns].reshape(count, rows, columns)
