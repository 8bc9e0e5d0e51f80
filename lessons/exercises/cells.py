"""Converts texts to cells of a spreadsheet, and back. A page's server loads this file, which loads no
controller."""

from __future__ import annotations

import re

_RISKY = r"""[\s']*[=+\-@\t\r\n\uff1d\uff0b\uff0d\uff20]"""
_BEGINS = re.compile(rf"(^|[;|\t\r\n])(?={_RISKY})")
_MARKED = re.compile(rf"(^|[;|\t\r\n])'(?={_RISKY})")
"""Beginnings that a spreadsheet would interpret as a formula, in half or full width; also after a separator
at which the spreadsheets of some countries split a cell."""


def cell(text: str) -> str:
    """Returns the content of a cell that shows this text, with an apostrophe before each formula."""
    return _BEGINS.sub(r"\1'", text)


def of_cell(text: str) -> str:
    """Returns the text from which `cell` has made this cell."""
    return _MARKED.sub(r"\1", text)
