"""The interface between the drive of an arm and the page that shows it."""

from __future__ import annotations

from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.arm.model import Model
from app.arm.orders import Order

Array = NDArray[np.float64]


class Audience(Protocol):
    """A page that shows a drive and can drag its targets. No method may block, because the arm
    is stopped if the watching process is silent."""

    def look(self) -> list[Order]:
        """Returns the targets that were dragged since the last call. Called continually."""
        ...

    def wish(self) -> str | None:
        """Returns the reason why the drive should end; None if it should continue."""
        ...

    def given(self, order: Order) -> None:
        """Called after an order was sent to the arm."""
        ...

    def see(self, t: float, row: Array, model: Model) -> None:
        """Called with each row of the loop at time t (s since the first row), and with the model at that
        time."""
        ...
