"""References whose time starts later, and previews that are extrapolated by a short time."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import final

from himpc.references.preview import Preview, Reference
from himpc.rotation import exp3


@dataclass(frozen=True, eq=False)
class Started:
    """A reference whose own time is zero at the time `start`, s."""

    reference: Reference
    start: float

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        return self.reference.preview(t - self.start, T_s, N)


@final
class Later(Mapping[str, Preview]):
    """Previews whose targets are extrapolated by `seconds` at constant velocity; only `value` changes.

    Attributes:
        previews: the previews, by the names of their tasks.
        seconds: the time of the extrapolation, s.
    """

    __slots__ = ("previews", "seconds")

    def __init__(self, previews: Mapping[str, Preview], seconds: float) -> None:
        self.previews, self.seconds = previews, seconds

    def __getitem__(self, name: str) -> Preview:
        preview = self.previews[name]
        gone = self.seconds * preview.velocity[0]
        value = preview.value
        if value.ndim == 1:
            return preview._replace(value=value + gone)
        return preview._replace(value=exp3(gone) @ value) if gone.size == 3 else preview

    def __iter__(self) -> Iterator[str]:
        return iter(self.previews)

    def __len__(self) -> int:
        return len(self.previews)
