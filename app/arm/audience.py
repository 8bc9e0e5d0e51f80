"""Whoever looks at a drive beside the terminal: a page."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.arm.model import Model
from app.arm.orders import Order

Array = NDArray[np.float64]


class Audience(Protocol):
    """Whoever looks at a drive and may drag its targets. Nothing here may wait: the arm is stopped when its
    watcher is silent."""

    def look(self) -> list[Order]:
        """Called all the time; returns the targets that were dragged since the last call."""
        ...

    def wish(self) -> str | None:
        """Why the drive shall end; None if it shall go on."""
        ...

    def given(self, order: Order) -> None:
        """An order was given to the arm."""
        ...

    def see(self, t: float, row: Array, model: Model) -> None:
        """A row of the loop at t (s since the first one), and the model at that time."""
        ...
