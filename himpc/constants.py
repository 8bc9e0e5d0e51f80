"""Numbers that the kernel shares with what is printed; here, since what is compiled is kept by the digest of
this folder."""

RANK_TOLERANCE = 1e-10
"""Directions that a level feels by less than this share of ‖B‖ are left to lower levels."""

RETURN_RATE = 5.0
"""1/s: a joint beyond its limit is asked to come back at this rate times the excess."""

AT_TORQUE, AT_VELOCITY, AT_POSITION = 1, 2, 4
"""Bits of telemetry's `at_bound`: which limits bind. A position limit does so through velocity rows, too."""
