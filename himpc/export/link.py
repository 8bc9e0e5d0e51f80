"""WebAssembly from an object file, by LLVM's linker."""

from __future__ import annotations

import shutil
import subprocess
import sys
import tempfile
from importlib.util import find_spec
from pathlib import Path

from himpc.export.entries import EXPORTED
from robots.errors import InputError

_STACK = 1 << 20
"""Bytes for local variables."""


def check_linker() -> None:
    """Raises InputError if there is no linker for WebAssembly."""
    if not _linker():
        raise InputError('the target wasm32 needs a linker: pip install "himpc-lab[export]" installs one')


def linked(code: bytes) -> bytes:
    """Returns the WebAssembly module that is linked from an object file. Raises InputError if there is no
    linker."""
    check_linker()
    with tempfile.TemporaryDirectory() as folder:
        object_file, made = Path(folder, "himpc.o"), Path(folder, "himpc.wasm")
        object_file.write_bytes(code)
        subprocess.run(
            [
                *(
                    *_linker(),
                    str(object_file),
                    "-o",
                    str(made),
                    "--no-entry",
                    "--allow-undefined",
                    "--gc-sections",
                ),
                *("--strip-all", "--export=__heap_base", "-z", f"stack-size={_STACK}", "--stack-first"),
                *(f"--export={name}" for name in EXPORTED),
            ],
            check=True,
            capture_output=True,
        )
        return made.read_bytes()


def _linker() -> list[str]:
    if find_spec("ziglang") is not None:
        return [sys.executable, "-m", "ziglang", "wasm-ld"]
    linker = shutil.which("wasm-ld")
    return [linker] if linker else []
