"""Functions that prepare the velocity-level scenes for their tests."""

from __future__ import annotations

import numpy as np

from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.scene import VelocityScene

HOME = np.array([1.48962656, 0.173941])
"""Position of the hand of the mobile manipulator at the start, in the horizontal plane, m."""


def scene(name: str, *assignments: str, controller: str | None = None) -> VelocityScene:
    found = prepared(load_scene(name), controller, assignments)
    assert isinstance(found, VelocityScene)
    return found
