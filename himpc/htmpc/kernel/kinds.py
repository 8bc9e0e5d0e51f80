"""Kinds of rows: the bounds of (7d), rows for the time beyond the horizon, levels above, obstacles. Pages
import this module for the names, without loading Numba."""

VELOCITY, POSITION, ACCELERATION, JERK, RAMP, STOP, LEXICOGRAPHIC, COLLISION = range(8)
KINDS = ("velocity", "position", "acceleration", "jerk", "ramp", "stop", "lexicographic", "collision")
