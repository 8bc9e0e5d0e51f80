"""Input and result of one control period on the printed route."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import LevelSolution
from himpc.formulation.memory import Memory
from himpc.limits import Rows
from himpc.prediction.joint import JointState
from himpc.references import Preview

Array = NDArray[np.float64]


class PeriodState(NamedTuple):
    """The input of one control period; `values` and `errors` are filled during the solution."""

    state: JointState
    memory: Memory
    previews: Mapping[str, Preview]
    rows: Rows
    values: dict[str, Array]
    errors: dict[str, Array]


class PeriodResult(NamedTuple):
    """The result of one control period: levels, ẋ_k of all rows, q at knots 0 … N, and how many times the
    cascade was solved."""

    solutions: list[LevelSolution]
    x_dot: Array
    predicted_q: Array
    iterations: int = 1
