"""Finds the source files that a compiled function depends on. When one of these files changes, the function
is compiled again."""

from __future__ import annotations

import re
import sys
from collections.abc import Callable
from functools import lru_cache
from hashlib import sha256
from pathlib import Path
from typing import Any

_IMPORTS = re.compile(r"^from ([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
"""Pattern of imports at the beginning of a line. Indented imports serve type annotations only and do not
change the code."""
_PACKAGE = __name__.partition(".")[0]


def digest_of(function: Callable[..., Any]) -> bytes:
    """Returns one digest of all files that `sources_of` returns for a function."""
    return sha256(b"".join(_read(file)[0] for file in sources_of(function))).digest()


def sources_of(function: Callable[..., Any]) -> list[Path]:
    """Returns the file of a function and all files that it imports, directly or through others. These files
    define the inline kernels and constants that the function uses. Only files of this package, of the
    function's package and of the packages of its inline kernels are included. The files of the tool chain,
    which set the compiler's options, are included too."""
    pieces = (getattr(value, "py_func", None) for value in function.__globals__.values())
    packages = {piece.__module__.partition(".")[0] for piece in (function, *filter(None, pieces))} | {
        _PACKAGE
    }
    files = {Path(function.__code__.co_filename)}
    waiting = [*files]
    files.update(Path(__file__).parent.glob("*.py"))
    while waiting:
        for module in _read(waiting.pop())[1]:
            file = getattr(sys.modules.get(module), "__file__", None)
            if module.partition(".")[0] in packages and file and Path(file) not in files:
                files.add(Path(file))
                waiting.append(Path(file))
    return sorted(files)


@lru_cache(maxsize=256)
def _read(file: Path) -> tuple[bytes, tuple[str, ...]]:
    """Returns the digest of a file's content, and the dotted names that the file imports: modules and other
    names."""
    text = file.read_bytes() if file.is_file() else b""
    imports = _IMPORTS.findall(text.decode(errors="replace"))
    names = [(module, f"{module}.{name}") for module, line in imports for name in re.findall(r"\w+", line)]
    return sha256(text).digest(), tuple(dict.fromkeys(name for pair in names for name in pair))
