"""The cells of a table for a spreadsheet."""

from __future__ import annotations

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""First characters of cells that a spreadsheet would interpret as a formula."""


def cell(text: str) -> str:
    """The cell in a form that a spreadsheet shows as text."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def of_cell(text: str) -> str:
    """The text of a cell that `cell` may have written."""
    return text[1:] if text.startswith("'") and text[1:].startswith(_FORMULA) else text
