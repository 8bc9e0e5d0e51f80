"""A square wave: the test signal of the HTMPC paper's section V."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.references.preview import Array, Preview, sampled, times

_EARLY = 1e-9
"""A switch takes place earlier by this time, s, so that the rounding error of a sum of periods cannot delay
the switch by a sample."""


@dataclass(frozen=True, eq=False)
class SquareWave:
    """x_d is at the peak for half a period and then in the valley for half a period, repeatedly. ẋ_d = ẍ_d =
    0.

    Attributes:
        peak, valley: (m,) m.
        half_period: duration of half a period, s.
        waves: number of periods, after which x_d stays in the valley; None: the wave never ends.
    """

    peak: Array
    valley: Array
    half_period: float = 8.0
    waves: int | None = None

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        half = np.floor((times(t, T_s, N) + _EARLY) / self.half_period)
        down = half % 2 == 1
        if self.waves is not None:
            down |= half >= 2 * self.waves
        position = np.where(down[:, None], self.valley, self.peak)
        return sampled(position, np.zeros_like(position), np.zeros_like(position))
