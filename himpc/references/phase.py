"""Time laws: the phase of a reference along its path."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np

from himpc.references.preview import Array


@dataclass(frozen=True)
class Phase:
    """A phase φ(t), its rate and its acceleration.

    The law `uniform` is φ = ωt + φ₀. The law `eased` is φ = ωt − sin ωt + φ₀; each turn starts and ends at
    rest.

    Attributes:
        omega: angular frequency ω, rad/s.
        law: "uniform" or "eased".
        offset: φ₀, rad.
    """

    omega: float
    law: Literal["uniform", "eased"] = "uniform"
    offset: float = 0.0

    def at(self, t: Array) -> tuple[Array, Array | float, Array | float]:
        """Returns (φ, φ̇, φ̈) at times t in seconds; constant derivatives are plain numbers."""
        w, wt = self.omega, self.omega * t
        if self.law == "uniform":
            return wt + self.offset, w, 0.0
        return wt - np.sin(wt) + self.offset, w * (1 - np.cos(wt)), w * w * np.sin(wt)


def column(rate: Array | float) -> Array | float:
    """Returns an array with one rate per sample as a column, which can be multiplied by rows of coordinates.
    A plain number is returned unchanged."""
    return rate[:, None] if isinstance(rate, np.ndarray) else rate
