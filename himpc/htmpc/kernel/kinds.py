"""Kinds of rows: the bounds of (7d), rows for the time beyond the horizon, rows of the levels above, and rows
of obstacles. Pages import the names from this module, without loading Numba."""

VELOCITY, POSITION, ACCELERATION, JERK, RAMP, STOP, LEXICOGRAPHIC, COLLISION = range(8)
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")
