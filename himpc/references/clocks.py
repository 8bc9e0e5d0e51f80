"""References whose time starts later than the time of the simulation."""

from __future__ import annotations

from dataclasses import dataclass

from himpc.references.preview import Preview, Reference


@dataclass(frozen=True, eq=False)
class Started:
    """A reference whose own time is zero at the time `start`, s."""

    reference: Reference
    start: float

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        return self.reference.preview(t - self.start, T_s, N)
