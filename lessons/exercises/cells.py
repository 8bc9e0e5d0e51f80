"""Converts texts to cells of a spreadsheet, and back."""

from __future__ import annotations

_FORMULA = ("=", "+", "-", "@", "\t", "\r", "\n")
"""First characters of cells that a spreadsheet would interpret as a formula."""


def cell(text: str) -> str:
    """Returns the content of a cell that shows this text, also if the text begins like a formula."""
    return f"'{text}" if text.startswith(_FORMULA) else text


def of_cell(text: str) -> str:
    """Returns the text from which `cell` has made this cell."""
    return text[1:] if text.startswith("'") and text[1:].startswith(_FORMULA) else text
