"""A dragged target whose filter is compiled."""

from __future__ import annotations

from himpc.references import POSITION_CAPS, Caps, Target
from himpc.references.preview import Array
from himpc.tick.kernel.target import roll


def dragged_target(value: Array, caps: Caps = POSITION_CAPS) -> Target:
    """A target at rest at `value`, as `Target` makes it, whose filter takes a few microseconds a period: for
    loops that have to keep a period. Loads compiled code now, so that no later tick waits for it."""
    return Target(value, caps, roll)
