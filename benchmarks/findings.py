"""The log of a random user: its actions, the faults found, and what was written to standard error."""

from __future__ import annotations

import os
import sys
import tempfile
from collections import Counter
from dataclasses import dataclass, field
from typing import Any


@dataclass
class Findings:
    """The actions of a random walk and the faults that it found."""

    seed: int
    actions: Counter[str] = field(default_factory=Counter)
    rows: int = 0
    scenes: set[str] = field(default_factory=set)
    lessons: set[str] = field(default_factory=set)
    worst_leak: float = 0.0
    faults: list[str] = field(default_factory=list)

    def blame(self, sentence: str) -> None:
        if sentence not in self.faults:
            self.faults.append(sentence)

    def as_data(self) -> dict[str, Any]:
        return {
            "seed": self.seed,
            "actions": dict(sorted(self.actions.items())),
            "rows": self.rows,
            "scenes": sorted(self.scenes),
            "lessons": sorted(self.lessons),
            "worst_leak": self.worst_leak,
            "faults": self.faults,
        }


class StandardError:
    """Stores what this process and its children write to standard error, and passes it on."""

    def __enter__(self) -> StandardError:
        self._file = tempfile.TemporaryFile()
        self._before = os.dup(2)
        sys.stderr.flush()
        os.dup2(self._file.fileno(), 2)
        return self

    def read(self) -> str:
        sys.stderr.flush()
        size = os.fstat(self._file.fileno()).st_size
        return os.pread(self._file.fileno(), size, 0).decode(errors="replace")

    def __exit__(self, *_: object) -> None:
        said = self.read()
        os.dup2(self._before, 2)
        os.close(self._before)
        self._file.close()
        sys.stderr.write(said)
