"""The inputs of a controller at a tick."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from himpc.references import Preview

Array = NDArray[np.float64]


class ControllerInput(NamedTuple):
    """The measured state, (n,) each, and the references' previews: all inputs of a controller at a tick."""

    q: Array
    v: Array
    previews: Mapping[str, Preview]
