"""A dragged target whose filter is compiled."""

from __future__ import annotations

from himpc.references import POSITION_CAPS, Caps, Target
from himpc.references.preview import Array
from himpc.tick.kernel.target import roll


def dragged_target(value: Array, caps: Caps = POSITION_CAPS) -> Target:
    """Returns a target at rest at `value`, like `Target`, for loops with a fixed period. Its filter is
    compiled and takes a few microseconds per period. The compiled code is loaded now, so that no later tick
    waits for it."""
    return Target(value, caps, roll)
