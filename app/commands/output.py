"""The output of a command: a table for people, JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from robots import InputError


def write_json(data: Any, target: str) -> None:
    """Writes JSON to a file, or to standard output for "-". Raises InputError if the file cannot be
    written."""
    text = json.dumps(data, indent=2, allow_nan=False, default=float)
    if target == "-":
        print(text)
        return
    try:
        Path(target).write_text(text + "\n")
    except OSError as error:
        raise InputError(
            f"--json {target}: cannot be written ({error.strerror}); give another file"
        ) from None


def print_table(title: str, columns: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Prints a table. Square brackets are printed as text, since names may come from other people's files."""
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=Text(title), title_justify="left")
    for number, column in enumerate(columns):
        table.add_column(column, overflow="fold", no_wrap=number == 0)
    for row in rows:
        table.add_row(*map(Text, row))
    Console().print(table)


def print_list(title: str, column: str, lines: Mapping[str, str], json_target: str | None) -> int:
    """Prints a list of names, each with a line of description, as a table or as JSON; returns the exit
    code."""
    if json_target is not None:
        write_json([{"name": name, "description": line} for name, line in lines.items()], json_target)
    else:
        print_table(title, (column, "what it is"), list(lines.items()))
    return 0
