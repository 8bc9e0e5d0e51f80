"""The objects around the robot, as a controller knows them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from robots.cover_shapes import WorldShape

Array = NDArray[np.float64]


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
