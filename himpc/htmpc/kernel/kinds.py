"""Kinds of rows: the bounds of (7d), room beyond the horizon, levels above, obstacles. A page that names them
loads no compiler."""

VELOCITY, POSITION, ACCELERATION, JERK, RAMP, STOP, LEXICOGRAPHIC, COLLISION = range(8)
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")
