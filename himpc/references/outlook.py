"""What a controller knows at one control tick: all references, and the objects around the robot."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import NamedTuple, final

from himpc.references.preview import Preview, Reference
from robots.arrays import Array
from robots.cover_shapes import WorldShape


class Observed(NamedTuple):
    """The objects around the robot, as a controller knows them at a tick. The real objects may differ.

    Attributes:
        shapes: the objects at their present positions.
        velocity: velocities of the objects' centres, (B, 3) m/s; None: the objects are at rest.
    """

    shapes: tuple[WorldShape, ...] = ()
    velocity: Array | None = None


NOTHING = Observed()
"""No known objects."""


@final
class Outlook(Mapping[str, Preview]):
    """The previews of all references at one tick. Each preview is sampled when it is first read. A controller
    that knows the coefficients of a reference needs no samples.

    Attributes:
        references: the references, by the names of their tasks.
        t: the present time, s.
        T_s, N: the samples are at t, t + T_s, …, t + N·T_s (s).
        observed: the objects around the robot.
    """

    __slots__ = ("N", "T_s", "_previews", "observed", "references", "t")

    def __init__(
        self,
        references: Mapping[str, Reference],
        t: float,
        T_s: float,
        N: int,
        observed: Observed = NOTHING,
    ) -> None:
        self.references, self.t, self.T_s, self.N = references, t, T_s, N
        self.observed = observed
        self._previews: dict[str, Preview] = {}

    def __getitem__(self, name: str) -> Preview:
        preview = self._previews.get(name)
        if preview is None:
            preview = self._previews[name] = self.references[name].preview(self.t, self.T_s, self.N)
        return preview

    def __iter__(self) -> Iterator[str]:
        return iter(self.references)

    def __len__(self) -> int:
        return len(self.references)


def observed_by(previews: Mapping[str, Preview]) -> Observed:
    """Returns the objects of an `Outlook`; no objects for previews of another type."""
    return previews.observed if isinstance(previews, Outlook) else NOTHING
