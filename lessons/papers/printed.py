"""The values that the papers print, one data file per table."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any


def printed(table: str) -> dict[str, Any]:
    """Returns the printed values of a table, e.g. printed("himpc_table_2")."""
    return read(table)


def read(table: str) -> dict[str, Any]:
    """Returns the content of a file of values."""
    return tomllib.loads((Path(__file__).parent / "values" / f"{table}.toml").read_text(encoding="utf-8"))
