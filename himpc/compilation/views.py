"""Array views for the compiled functions. A view is a part of a larger array, which the kernel's caller
owns."""

from __future__ import annotations

import linecache
from typing import Any

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
