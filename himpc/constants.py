"""Numbers that the compiled tick shares with the equations as printed."""

RANK_TOLERANCE = 1e-10
"""Directions that a level feels by less than this share of ‖B‖ are left to lower levels."""

RETURN_RATE = 5.0
"""1/s: a joint beyond its limit is asked to come back at this rate times the excess."""

AT_TORQUE, AT_VELOCITY, AT_POSITION = 1, 2, 4
"""Bits of telemetry's `at_bound`: which limits bind. A position limit does so through velocity rows, too."""

APPROACH_RATE = 6.0
"""1/s: how fast a dragged target closes the remaining distance near the hand."""
VELOCITY_RATE = 36.0
"""1/s: how fast its velocity follows the one wanted."""
STILL = 1e-9
"""Below this distance and speed it snaps to rest: it must not drift for ever."""
