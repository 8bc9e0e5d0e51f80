"""A constant reference."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache

import numpy as np

from himpc.references.preview import Array, Preview


@dataclass(frozen=True, eq=False)
class Hold:
    """A constant x_d.

    Attributes:
        value: (m,) coordinates, or a rotation matrix (3, 3).
        m: number of coordinates that the task controls. It is needed only if it differs from the size of the
            value (an orientation task on fewer than three axes).
    """

    value: Array
    m: int | None = None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        rest = still(N, self.m or self.value.shape[0])
        return Preview(self.value, rest.displacement, rest.velocity, rest.acceleration)


@lru_cache(maxsize=64)
def still(N: int, m: int) -> Preview:
    """Returns the preview of m coordinates that rest at zero."""
    zeros = np.zeros((N + 1, m))
    zeros.setflags(write=False)
    return Preview(zeros[0], zeros, zeros, zeros)
