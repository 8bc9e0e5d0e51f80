"""Constants that the compiled tick and the printed equations share."""

RANK_TOLERANCE = 1e-10
"""A direction whose effect on a level is below this share of ‖B‖ is left to lower levels."""

RETURN_RATE = 5.0
"""1/s: a joint beyond its limit must return at this rate times the excess."""

WITHIN = 0.25
"""m: pairs of links or objects that are farther apart have no row."""
FADE = 0.05
"""m: over this distance before WITHIN a bound loosens to none; a pair that enters has no bound yet."""
RETREAT = 0.2
"""m/s: the fastest retreat that a row of a distance asks for."""
TURN_PULL = 5.0
"""rad/m: how much larger than that of a position the error is on which a task of angles acts at most."""

AT_TORQUE, AT_VELOCITY, AT_POSITION = 1, 2, 4
"""Bits of telemetry's `at_bound`: which limits bind. Velocity rows that impose a position limit count as
position."""

APPROACH_RATE = 6.0
"""1/s: rate at which a dragged target reduces the remaining distance near the hand."""
VELOCITY_RATE = 36.0
"""1/s: rate at which its velocity approaches the desired velocity."""
STILL = 1e-9
"""Below this distance and speed the target is set to rest; it must not drift for ever."""
