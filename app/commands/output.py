"""The output of a command: a table for people, JSON for programs, a progress bar on a terminal."""

from __future__ import annotations

import errno
import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any

from robots import InputError


def write_json(data: Any, target: str) -> None:
    """Writes JSON to a file, or to standard output for "-". Raises InputError if the file cannot be
    written."""
    text = json.dumps(data, indent=2, allow_nan=False, default=float)
    if target == "-":
        print(text)
        return
    write_file("--json", target, text + "\n")


def write_file(option: str, target: str, content: bytes | str) -> None:
    """Writes the file that an option names, see `write_files`. Raises InputError if it cannot be written."""
    from lessons.outputs import write_files

    with _reported(option, target):
        write_files({target: content})


def check_file(option: str, target: str | None) -> None:
    """Raises InputError if the file that an option names can certainly not be written; "-" is no file."""
    from lessons.outputs import check_target

    if target not in (None, "-"):
        with _reported(option, target):
            check_target(target)


@contextmanager
def _reported(option: str, target: str) -> Iterator[None]:
    try:
        yield
    except OSError as error:
        raise InputError(
            f"{option} {target}: cannot be written ({error.strerror}); give another file"
        ) from None


def figure(value: float | None, least: float = 1e-9) -> str:
    """Returns a number for people: three digits, and "0.00" for the rounding errors of a calculation, which
    are smaller than `least`; "–" if there is no number."""
    if value is None or not math.isfinite(value):
        return "–"
    return "0.00" if abs(value) < least else f"{value:.3g}"


def readable_unit(value: float | None, unit: str) -> tuple[str, str]:
    """Returns the number and the unit of an error: lengths in mm, and "0.00" for less than 0.005."""
    factor, unit = (1e3, "mm") if unit == "m" else (1.0, unit)
    return figure(None if value is None else factor * value, 0.005), unit


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


_FULL = (errno.ENOSPC, errno.EFBIG, errno.EDQUOT, errno.EIO)
_MEMORY = ("failed to map segment", "allocate memory", "' is required for ")
"""Parts of messages about too little memory. The last one is of Python's own parser, whose node lacks a field
that could not be allocated, while a module is imported."""


def machine_failure(error: BaseException) -> str | None:
    """Returns one sentence if the machine is the cause of an error: a full disk, an encoding that lacks a
    character, or too little memory. Returns None for any other error."""
    if isinstance(error, UnicodeEncodeError):
        return (
            f"the output cannot be written: the encoding {error.encoding} lacks the character "
            f"{error.object[error.start]!a}; set PYTHONIOENCODING=utf-8:replace"
        )
    if isinstance(error, OSError) and error.errno in _FULL:
        what = error.filename or "the output"
        return f"{what} cannot be written ({error.strerror}): free some space, or write to another place"
    each: BaseException | None = error
    while each is not None:  # a library may raise another exception while it reports the first one
        if isinstance(each, MemoryError) or any(words in str(each) for words in _MEMORY):
            return "there is too little memory: end other programs, or raise the limit (ulimit -v)"
        each = each.__cause__ or each.__context__
    return None


@contextmanager
def progress_bar(title: str, shown: bool = True) -> Iterator[Callable[[float], None]]:
    """Yields a function that sets the completed share. The bar is printed on stderr, if stderr is a
    terminal."""
    if not shown or not sys.stderr.isatty():
        yield lambda share: None
        return
    from rich.console import Console
    from rich.progress import BarColumn, Progress, TaskProgressColumn, TextColumn, TimeRemainingColumn

    columns = (TextColumn("{task.description}"), BarColumn(), TaskProgressColumn(), TimeRemainingColumn())
    with Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(title, total=1.0)
        yield lambda share: bar.update(task, completed=share)
