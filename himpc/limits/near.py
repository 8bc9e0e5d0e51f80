"""The pairs whose distances a controller keeps."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Near(NamedTuple):
    """The pairs of links, or of a link and an object, that could reach d_safe first; the nearest pair comes
    first.

    Attributes:
        distance: d, (r,) m, negative inside.
        gradient: ∇d, (r, n) m/rad.
        moving: (r,) m/s, the speed at which the object's own motion reduces d.
        share: (r,), the share of d_safe and of the margin that is kept: below 1 for links that are close
            together in the home posture.
        names: the name of each pair.
    """

    distance: Array
    gradient: Array
    moving: Array
    share: Array
    names: tuple[str, ...]
