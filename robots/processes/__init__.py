"""Processes that we start: kept within limits, and ended with all that they started."""
