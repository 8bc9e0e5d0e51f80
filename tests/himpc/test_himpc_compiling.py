"""Code is compiled once, by one process, if it can be stored anywhere; it is never compiled during a run."""

from __future__ import annotations

import ast
import ctypes
import os
import re
import stat
import subprocess
import sys
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from himpc.compilation.compiled import VECTOR, WHOLE, intermediate, plain
from himpc.compilation.compiling import LARGEST, compile_all, compiled_functions
from himpc.compilation.sources import sources_of
from himpc.tick.kernel.linear import dot

ROOT = Path(__file__).parents[2]

PR_CAPBSET_DROP, CAP_DAC_OVERRIDE = 24, 1

SMALL = """
from himpc.compilation.compiled import NUMBER, inline_kernel, kernel

@inline_kernel
def _twice(x):
    return 2.0 * x

@kernel(NUMBER)
def twice(x):
    return _twice(x)
"""

LOAD = """
import os, sys
from himpc.catalog import CONTROLLERS
from himpc.compilation.compiled import on_compiled
found = []
with on_compiled(found.append):
    import small
assert small.twice(2.0) == 4.0
print(len(found), small.twice.stats.cache_path)
"""


def like_anybody() -> None:
    """Removes root's permission to write everywhere, starting with the next program."""
    if os.getuid() == 0:
        assert ctypes.CDLL(None).prctl(PR_CAPBSET_DROP, CAP_DAC_OVERRIDE, 0, 0, 0) == 0


def start(
    folder: Path, script: str = LOAD, before: Callable[[], None] | None = None, **environment: str
) -> subprocess.Popen[str]:
    """Starts a process that can read everything, but can write only to a temporary folder of the test. If
    `before` is given, the process calls this function first."""

    def prepare() -> None:
        like_anybody()
        if before is not None:
            before()

    install, home, temporary = folder / "install", folder / "home", folder / "tmp"
    if not install.exists():
        for each in (install, home, temporary):
            each.mkdir()
        (install / "small.py").write_text(SMALL)
        install.chmod(0o555)
        home.chmod(0o555)
    return subprocess.Popen(
        [sys.executable, "-c", script],
        cwd=folder,
        env={
            "PATH": os.environ["PATH"],
            "PYTHONPATH": f"{install}:{ROOT}",
            "PYTHONDONTWRITEBYTECODE": "1",
            "HOME": str(home),
            "TMPDIR": str(temporary),
            **environment,
        },
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        preexec_fn=prepare,
    )


def compiled_and_place(process: subprocess.Popen[str]) -> tuple[int, str]:
    out, errors = process.communicate(timeout=120)
    assert process.returncode == 0, errors
    count, place = out.split()
    return int(count), place


def test_what_cannot_be_kept_here_goes_to_a_temporary_folder_of_ones_own(tmp_path: Path) -> None:
    """If the installation and the home folder are read-only, functions are still compiled only once, and
    stored where no other user can write."""
    first, place = compiled_and_place(start(tmp_path))
    assert first == 2
    assert Path(place).is_relative_to(tmp_path / "tmp")
    kept = Path(place).parent
    assert stat.S_IMODE(kept.stat().st_mode) == 0o700
    assert compiled_and_place(start(tmp_path)) == (0, place)


def test_a_folder_that_others_may_write_to_is_not_trusted(tmp_path: Path) -> None:
    _, place = compiled_and_place(start(tmp_path))
    kept = Path(place).parent
    kept.chmod(0o777)
    count, other = compiled_and_place(start(tmp_path))
    assert count == 2
    assert not Path(other).is_relative_to(kept)


def test_without_any_folder_it_is_compiled_and_not_kept(tmp_path: Path) -> None:
    script = LOAD.replace("import os, sys", "import os, sys, tempfile; tempfile.tempdir = '/nowhere'")
    count, place = compiled_and_place(start(tmp_path, script))
    assert (count, place) == (2, "None")


def test_processes_that_start_together_compile_once(tmp_path: Path) -> None:
    """One process compiles; the other processes wait and then load the code from disk."""
    shared = tmp_path / "shared"
    shared.mkdir()
    together = [start(tmp_path, NUMBA_CACHE_DIR=str(shared)) for _ in range(3)]
    assert sorted(compiled_and_place(each)[0] for each in together) == [0, 0, 2]


def test_who_has_it_compiled_runs_what_is_on_disk(tmp_path: Path) -> None:
    """A process that compiled a function then loads it from disk, because the code in memory gives results
    that differ in the last digit."""
    script = LOAD + "print(sum(small.twice.stats.cache_hits.values()), file=sys.stderr)"
    for _ in range(2):
        process = start(tmp_path, script)
        assert process.communicate(timeout=120)[1].splitlines()[-1] == "1"


def test_what_is_on_disk_needs_no_compiler() -> None:
    """Loading compiled functions imports no part of Numba's compiler. Its preparation takes longer than
    loading all functions, and it imports SciPy."""
    compile_all(lambda *_: None)
    script = (
        "import sys\n"
        "from himpc.compilation.compiling import compile_all\n"
        "compile_all(print)\n"
        "print(*sorted({'numba', 'scipy.linalg', 'numba.np.linalg'} & set(sys.modules)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], cwd=ROOT, capture_output=True, text=True, check=True
    )
    assert done.stdout == "numba\n"


def test_a_piece_from_another_folder_is_part_of_what_is_kept(tmp_path: Path) -> None:
    """When an inline kernel or a constant in another folder changes, the functions that use it are compiled
    again."""
    for folder in ("install/parts/below", "home", "tmp"):
        (tmp_path / folder).mkdir(parents=True)
    above, below = SMALL.split("\n\n@kernel")
    above = f"from parts.below.constants import TWO\n{above.replace('2.0', 'TWO')}"
    constants = tmp_path / "install" / "parts" / "below" / "constants.py"
    constants.write_text("TWO = 1.0")
    (tmp_path / "install" / "parts" / "part.py").write_text(above)
    (tmp_path / "install" / "small.py").write_text(
        "from himpc.compilation.compiled import NUMBER, kernel\nfrom parts.part import _twice\n\n"
        f"@kernel{below}"
    )
    wrong = start(tmp_path)
    # The AssertionError is raised in the script LOAD: the compiled function returns half of the expected
    # value.
    assert "AssertionError" in wrong.communicate(timeout=120)[1]
    constants.write_text("TWO = 2.0")
    assert [compiled_and_place(start(tmp_path))[0] for _ in range(2)] == [2, 0]
    (tmp_path / "install" / "parts" / "part.py").write_text(f"{above}\n# changed")
    assert compiled_and_place(start(tmp_path))[0] == 2


def test_all_that_is_compiled_in_is_part_of_what_is_kept() -> None:
    """The digest of a compiled function includes all files of this package that its module imports, directly
    or through others."""

    def imported(file: Path, known: set[Path]) -> set[Path]:
        known.add(file)
        for node in ast.walk(ast.parse(file.read_text())):
            if isinstance(node, ast.ImportFrom):
                names = (str(node.module), *(f"{node.module}.{alias.name}" for alias in node.names))
                for name in names:
                    path = ROOT.joinpath(*name.split(".")).with_suffix(".py")
                    if name.startswith("himpc.") and path.exists() and path not in known:
                        imported(path, known)
        return known

    checked: set[Path] = set()
    for module, names in compiled_functions().items():
        loaded = import_module(module)
        found = sources_of(plain(getattr(loaded, next(iter(names)).rpartition(".")[2])))
        assert imported(Path(str(loaded.__file__)), set()) <= set(found)
        checked.update(found)
    assert ROOT / "himpc" / "constants.py" in checked


def test_the_largest_function_is_compiled_without_waiting_for_others() -> None:
    """A second process compiles it meanwhile. Its module imports none that is compiled by itself."""
    largest = import_module(LARGEST)
    files = set(sources_of(largest.control_period.py_func)) - {Path(str(largest.__file__))}
    own = re.compile(r"^@kernel\b|= kernel\(", re.MULTILINE)
    assert ROOT / "himpc" / "tick" / "kernel" / "linearize.py" in files
    assert [file.name for file in files if own.search(file.read_text())] == []


def test_nobody_but_compiled_code_calls_a_piece() -> None:
    """A call of an inline kernel from Python raises TypeError, also after this process compiled the kernel as
    a part of a function, as for an export."""

    def caller(a: Any, b: Any, n: int) -> float:
        return dot(a, b, n)

    for _ in range(2):
        with pytest.raises(TypeError, match="dot can be called by compiled functions only"):
            dot(np.ones(2), np.ones(2), 2)
        intermediate(caller, (VECTOR, VECTOR, WHOLE))


def test_the_first_run_equals_the_second(first_and_second_run: tuple[tuple[Path, str], ...]) -> None:
    """With an empty cache, the first run gives bitwise the same numbers as the second run."""
    runs = []
    for (file, said), compiles in zip(first_and_second_run, (True, False), strict=True):
        assert ("compiling" in said) == compiles
        with np.load(file) as found:
            runs.append({key: found[key].tobytes() for key in ("q", "v", "tau")})
    assert runs[0] == runs[1]


def test_one_word_tells_of_it_once(tmp_path: Path) -> None:
    process = start(tmp_path)
    errors = process.communicate(timeout=120)[1]
    assert errors.count("compiling") == 1 and len(errors.splitlines()) == 1
    assert start(tmp_path).communicate(timeout=120)[1] == ""


def test_everything_compiled_is_counted() -> None:
    """The list that is used to show the progress contains every function that Numba compiles."""
    told_of: list[tuple[int, int]] = []
    compile_all(lambda ready, total: told_of.append((ready, total)))
    listed = compiled_functions()
    for module in listed:
        for name, value in vars(import_module(module)).items():
            if hasattr(value, "py_func"):
                function = value.py_func
                assert f"{function.__module__}.{function.__qualname__}" in listed[function.__module__], name
    assert all(ready <= total for ready, total in told_of)
    again: list[Any] = []
    compile_all(lambda *counts: again.append(counts))
    assert not again
