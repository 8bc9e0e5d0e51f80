"""What a page asks of the inside of a tick, and what it is told."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from lessons.geometry.matrix import Matrix
    from lessons.geometry.plane import Plane


@dataclass(frozen=True)
class InsideRequest:
    """What of the inside of a tick the page shows; the answers come with every `Status`.

    plane: the two joints whose plane is cut, None: no plane; through: name of the level whose solution the
    cut goes through, "" for what is applied; shift: N·m of the other joints' increments from there; matrix:
    name of the level whose QP is shown as a picture, None: no picture; spectrum: eigenvalues of I − M⁻¹M̄.
    """

    plane: tuple[int, int] | None = None
    through: str = ""
    shift: float = 0.0
    matrix: str | None = None
    spectrum: bool = False


@dataclass(frozen=True, eq=False)
class Inside:
    """The inside of the last tick, as far as it was asked for; see `InsideRequest`.

    why_not: a sentence, where there is no tick to show; spectrum: (n,).
    """

    plane: Plane | None = None
    matrix: Matrix | None = None
    spectrum: np.ndarray | None = None
    why_not: str = ""
