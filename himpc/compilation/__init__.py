"""The Numba tool chain: functions are compiled once, kept on disk, and loaded with their module."""
