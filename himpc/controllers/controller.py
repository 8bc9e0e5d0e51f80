"""The interface of a torque-level controller."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from himpc.formulation.settings import Settings
from himpc.plan import Plan
from himpc.references import Preview

Array = NDArray[np.float64]


class Controller(Protocol):
    """A torque-level controller. It computes a torque and its evidence from the measured state and the
    references."""

    @property
    def settings(self) -> Settings:
        """The settings in use."""
        ...

    def reset(self, tau_0: Array) -> None:
        """Clears its memory; τ₀ (n,) N·m is the torque acting now."""
        ...

    def configure(self, settings: Settings) -> None:
        """Applies new settings immediately and without a jump of the torque. If they do not fit, it raises
        InputError and changes nothing."""
        ...

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period. It raises no error for any state, and the torque is always finite."""
        ...
