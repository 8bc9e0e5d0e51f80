"""The objects around the robot, as a controller knows them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.cover_shapes import WorldShape

Array = NDArray[np.float64]


class Observed(NamedTuple):
    """The objects around the robot, as a controller knows them at a tick; the truth may be different.

    Attributes:
        shapes: the objects at their present places.
        velocity: of their centres, (B, 3) m/s; None: they are at rest.
    """

    shapes: tuple[WorldShape, ...] = ()
    velocity: Array | None = None


NOTHING = Observed()
"""A state without known objects."""
