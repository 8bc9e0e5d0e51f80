"""Exported controllers in this process, through the same C interface that other programs use."""

from __future__ import annotations

import ctypes
import platform
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any, final

import numpy as np

from himpc.export.image import Image
from himpc.export.objects import object_code, target_named
from robots.arrays import Array
from robots.errors import InputError

_ALIGNMENT = 64


def target_here() -> str:
    """Returns the name of the export target whose code this machine can run. Raises InputError if there is
    none."""
    system = {"linux": "linux", "darwin": "macos"}.get(sys.platform, sys.platform)
    machine = {"amd64": "x86_64", "arm64": "aarch64"}.get(platform.machine().lower(), platform.machine())
    target_named(f"{machine}-{system}")
    return f"{machine}-{system}"


def build(folder: Path) -> Path:
    """Compiles and links the exported controller for this machine; returns the shared library in `folder`.
    Raises InputError if there is no C compiler."""
    compiler = shutil.which("cc")
    if compiler is None:
        raise InputError("the controller is linked by a C compiler, but none named cc was found: install one")
    made, library = folder / "himpc.o", folder / "himpc.so"
    made.write_bytes(object_code(target_named(target_here())))
    link(made, library)
    return library


def link(made: Path, library: Path) -> None:
    """Links an object file to a shared library by the C compiler."""
    subprocess.run(["cc", "-shared", "-o", library, made, "-lm"], check=True)


@final
class NativeController:
    """A controller in a shared library: `himpc_tick`, `himpc_reset` and `himpc_set` of `himpc.h`."""

    def __init__(self, library: Path, image: bytes, manifest: dict[str, Any]) -> None:
        """library: the library that `build` returns; image, manifest: see `Image`. Raises ValueError if the
        image is damaged, is not that of the manifest, or is for another kernel."""
        self._c = ctypes.CDLL(str(library))
        pointer, whole = ctypes.c_void_p, ctypes.c_int
        self._c.himpc_tick.argtypes = [pointer] * 5
        self._c.himpc_set.argtypes = [pointer, whole, whole, pointer, whole]
        self._c.himpc_reset.argtypes = [pointer] * 2
        self._c.himpc_check.argtypes = [pointer, ctypes.c_uint, ctypes.c_uint64]
        self.manifest = manifest
        self.n = len(manifest["joints"])
        self._room = np.zeros(len(image) // 8 + _ALIGNMENT // 8)
        start = -self._room.ctypes.data % _ALIGNMENT
        self.memory = self._room.view(np.uint8)[start : start + len(image)]
        self.memory[:] = np.frombuffer(image, np.uint8)
        self._at = self.memory.ctypes.data
        self._numbers = np.zeros((4, self.n))
        self._addresses = [row.ctypes.data for row in self._numbers]
        if self.check(len(image)) != 0:
            raise ValueError("this image is damaged, or it is for another controller or another kernel")
        self.reset()

    @classmethod
    def of(cls, library: Path, image: Image) -> NativeController:
        return cls(library, image.memory, image.manifest)

    def check(self, size: int) -> int:
        """Returns the result of `himpc_check` for the memory, which is an image until `reset`."""
        return self._c.himpc_check(self._at, size, int(self.manifest["digest"], 16))

    def reset(self, tau: Array | None = None) -> None:
        """Clears everything except the settings. tau: the torque that acts now, (n,) N·m; None: zero."""
        self._numbers[3] = 0.0 if tau is None else tau
        self._c.himpc_reset(self._at, self._addresses[3])

    def tick(self, q: Array, v: Array, tau_applied: Array | None = None) -> tuple[Array, int]:
        """Performs one control period.

        Args:
            q, v: measured state, (n,) rad and rad/s.
            tau_applied: the torque that acted during the last period, (n,) N·m; None: that of the last tick.

        Returns:
            (the torque to apply, (n,) N·m; which fallback acted, an index of `FALLBACKS`).
        """
        numbers, addresses = self._numbers, self._addresses
        numbers[0], numbers[1] = q, v
        applied = None
        if tau_applied is not None:
            numbers[2], applied = tau_applied, addresses[2]
        fallback = self._c.himpc_tick(self._at, addresses[0], addresses[1], applied, addresses[3])
        return numbers[3].copy(), fallback

    def set(self, what: int, index: int, values: Any) -> int:
        """Changes a setting, see `himpc.export.kernel.adjust`; returns 0 or a fault."""
        numbers = np.array(values, float).ravel()
        return self._c.himpc_set(self._at, what, index, numbers.ctypes.data, numbers.size)

    def view(self, name: str) -> np.ndarray:
        """Returns an array of the manifest as a view of the controller's memory, not as a copy."""
        (array,) = (array for array in self.manifest["arrays"] if array["name"] == name)
        count = int(np.prod(array["shape"]))
        part = self.memory[array["offset"] : array["offset"] + 8 * count]
        return part.view(array["type"]).reshape(array["shape"])
