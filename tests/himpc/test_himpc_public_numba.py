"""All functions also run with only the documented interface of Numba, without our own tool chain, and give
the same numbers."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from short_runs import RUNS

from himpc.compilation import SWITCH

HERE = Path(__file__).parent

NO_PRIVATE = """
import runpy, sys
sys.argv[:] = sys.argv[1:]
runpy.run_path(sys.argv[0], run_name="__main__")
ours = ("private", "private_views", "pieces", "keeping")
print(*(name for name in ours if f"himpc.compilation.{name}" in sys.modules))
"""

VIEWS = """
import numpy as np
from himpc.compilation.compiled import VECTOR, WHOLE, kernel
from himpc.compilation.views import borrowed, matrices, matrix, vector

@kernel(VECTOR, WHOLE)
def double(data, n):
    for x in vector(data, 1, n):
        data[0] += x
    table, tables = matrix(borrowed(data), 3, 2, 3), matrices(data, 3, 1, 2, 3)
    for i in range(2):
        for j in range(3):
            table[i, j] += tables[0, i, j]
    return tables.sum()

if __name__ == "__main__":
    data = np.arange(10.0)
    assert double(data, 2) == 2 * np.arange(3.0, 9.0).sum()
    assert data.tolist() == [3.0, 1.0, 2.0, 6.0, 8.0, 10.0, 12.0, 14.0, 16.0, 9.0]
    try:
        double(np.arange(10), 2)
    except TypeError:
        pass
    else:
        raise AssertionError("it is compiled for arguments of other types")
"""


def on_numba_alone(folder: Path, *arguments: str, **environment: str) -> None:
    """Runs a program with the public tool chain, with its code in a folder of the test. No module of our own
    tool chain is loaded."""
    done = subprocess.run(
        [sys.executable, "-c", NO_PRIVATE, *arguments],
        env={**os.environ, SWITCH: "public", "NUMBA_CACHE_DIR": str(folder / "cache"), **environment},
        cwd=HERE.parents[1],
        capture_output=True,
        text=True,
    )
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == []


pytestmark = pytest.mark.nightly("himpc/compilation", "himpc/tick/kernel", "himpc/htmpc/kernel")


# LLVM's optimizations are switched off: with them, the cascade alone takes three minutes of a core here.
@pytest.mark.parametrize(
    ("names", "environment"),
    [(("osf", "himpc", "htmpc"), {"NUMBA_OPT": "0"}), (("himpc",), {"NUMBA_DISABLE_JIT": "1"})],
)
def test_the_numbers_are_the_same(
    names: tuple[str, ...], environment: dict[str, str], tmp_path: Path
) -> None:
    file = tmp_path / "found.npz"
    on_numba_alone(tmp_path, str(HERE / "short_runs.py"), str(file), *names, **environment)
    assert [*(tmp_path / "cache").rglob("*.nbc")] or "NUMBA_DISABLE_JIT" in environment
    with np.load(file) as found:
        for name in names:
            expected = RUNS[name]()
            assert np.abs(expected).max() > 1e-3 and np.ptp(expected, axis=0).max() > 1e-4
            np.testing.assert_allclose(found[name], expected, rtol=1e-9, atol=1e-9)


def test_views_are_parts_of_the_array(tmp_path: Path) -> None:
    (tmp_path / "views.py").write_text(VIEWS)
    on_numba_alone(tmp_path, str(tmp_path / "views.py"))
