"""A target or goal in the 3D view that can also be moved without a mouse."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import viser.transforms as vtf


@dataclass(frozen=True)
class Movable:
    """A target that code moves on viser's loop, with the same effect as a drag of its arrows or rings.

    Attributes:
        name: the name of its task or role.
        place: returns its present position (3,), m; None while it has no position.
        move: moves it to a position (3,), m; None: it can only be turned.
        turn: turns it about the world's axes by a rotation vector (3,), rad; None: it can only be moved.
    """

    name: str
    place: Callable[[], np.ndarray | None]
    move: Callable[[np.ndarray], None] | None = None
    turn: Callable[[np.ndarray], None] | None = None


def turned(rotation: np.ndarray, by: np.ndarray) -> np.ndarray:
    """Returns the rotation (3, 3) followed by a rotation about the world's axes, by the rotation vector (3,),
    rad."""
    return vtf.SO3.exp(by).as_matrix() @ rotation
