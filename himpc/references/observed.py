"""What a controller knows of the objects around the robot."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.cover_shapes import WorldShape

Array = NDArray[np.float64]


class Observed(NamedTuple):
    """The objects around the robot, as a controller knows them at a tick; the truth may be different.

    Attributes:
        shapes: where they are now.
        velocity: of their middles, (B, 3) m/s; None: they are at rest.
    """

    shapes: tuple[WorldShape, ...] = ()
    velocity: Array | None = None


NOTHING = Observed()
"""No object is known."""
