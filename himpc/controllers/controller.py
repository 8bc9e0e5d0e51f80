"""What a session needs of a controller."""

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
    """A torque-level controller: measured state and reference in, torque and evidence out."""

    @property
    def settings(self) -> Settings:
        """The settings in use."""
        ...

    def reset(self, tau_0: Array) -> None:
        """Forgets its memory; τ₀ (n,) N·m is the torque acting now."""
        ...

    def configure(self, settings: Settings) -> None:
        """Takes new settings at once and bumplessly. If they do not fit: InputError, and nothing changes."""
        ...

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """One control period; never raises for a state, and the torque is finite."""
        ...
