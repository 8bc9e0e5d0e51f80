"""Data about the inside of a tick: the page's request and the simulation's answer."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lessons.geometry.matrix import Matrix
    from lessons.geometry.plane import Plane


@dataclass(frozen=True)
class InsideRequest:
    """The internal data of a tick that the page shows; the answer comes with every `Status`.

    plane: the two joints whose increments span the plane of the cut, None: no plane; through: name of
    the level whose solution the plane contains, "" for the applied solution; shift: offset of the
    other joints' increments from that solution, N·m; matrix: name of the level whose QP is shown as a
    picture, None: no picture; spectrum: whether to send the eigenvalues of I − M⁻¹M̄.
    """

    plane: tuple[int, int] | None = None
    through: str = ""
    shift: float = 0.0
    matrix: str | None = None
    spectrum: bool = False


@dataclass(frozen=True, eq=False)
class Inside:
    """The requested internal data of the last tick; see `InsideRequest`.

    why_not: a sentence if there is no tick to show; spectrum: the eigenvalues, (n,).
    """

    plane: Plane | None = None
    matrix: Matrix | None = None
    spectrum: np.ndarray | None = None
    why_not: str = ""
