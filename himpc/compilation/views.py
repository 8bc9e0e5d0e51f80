"""Array views for the compiled functions. A view is a part of a larger array, which the kernel's caller
owns."""

from __future__ import annotations

import linecache
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

_VIEW = {1: "vector", 2: "matrix", 3: "matrices"}


def view(memory: str, start: str, shape: str) -> str:
    """Returns the text of a view: `view("data", "where[3]", "N 4")` is "matrix(data, where[3], s.N, 4)".
    s contains the values of the letters."""
    sizes = [size if size.isdecimal() else f"s.{size}" for size in shape.split()]
    return f"{_VIEW[len(sizes)]}({memory}, {start}, {', '.join(sizes)})"


def shapes_of(table: type, kind: Any) -> dict[str, str]:
    """Returns the shapes of a table's arrays of one kind, by name. Each annotation of the table is
    Annotated[kind, shape, …]."""
    hints = get_type_hints(table, include_extras=True)
    return {name: hint.__metadata__[0] for name, hint in hints.items() if hint.__origin__ == kind}


def views(memory: str, where: str, shapes: dict[str, str]) -> str:
    """Returns the text of the views of all arrays in a memory, separated by commas. `where` is the name of
    the array with the index at which each array begins, in the order of the shapes."""
    return ", ".join(view(memory, f"{where}[{index}]", shape) for index, shape in enumerate(shapes.values()))


def as_function(name: str, module: str, text: str, **names: Any) -> Any:
    """Returns the function that a text with views defines.

    Args:
        name, module: names of the function and of its module.
        text: the definition; tracebacks and debuggers show it.
        names: what the text uses besides views.
    """
    file = f"<{module}.{name}>"
    linecache.cache[file] = len(text), None, text.splitlines(True), file
    scope = {"__name__": module, "vector": vector, "matrix": matrix, "matrices": matrices, **names}
    exec(compile(text, file, "exec"), scope)
    return scope[name]
