"""The folder with the users' files that may be named not only at the start of the program, but also later."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path

from robots import InputError
from robots.errors import shortened


@dataclass(frozen=True)
class Folder:
    """path: absolute, without symbolic links."""

    path: Path

    @classmethod
    def at(cls, name: str) -> Folder:
        """Returns the folder with this name. Raises InputError if it does not exist."""
        try:
            path = Path(os.path.realpath(name))
        except (OSError, ValueError):  # the folder "." was removed, or this is not a path
            path = None
        if path is None or not path.is_dir():
            raise InputError(f"--own-files {shortened(name, 100)} is not a folder: give one that exists")
        return cls(path)

    def holds(self, path: str) -> bool:
        """Returns whether a path is below the folder after all links and dots are resolved."""
        try:
            return self.path in Path(os.path.realpath(path)).parents
        except ValueError:  # e.g. a zero byte
            return False

    def admits(self, name: str) -> str:
        """Returns the path of a file below the folder, after all links and dots of its name are resolved. The
        path is relative if the file is below the folder in which the program was started.

        Raises:
            InputError: the path leads outside the folder. The message does not reveal whether there is such a
                file.
        """
        file = str(self.path / name)
        if not self.holds(file):
            raise InputError(
                f"{shortened(name, 100)}: the page opens only files below the folder in which himpc-lab was "
                "started, or below the folder of --own-files DIR"
            )
        path, here = Path(os.path.realpath(file)), Path(os.path.realpath(Path.cwd()))
        return str(path.relative_to(here) if path.is_relative_to(here) else path)
