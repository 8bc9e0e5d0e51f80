"""The reports of a running session to the page, for torque level and velocity level."""
