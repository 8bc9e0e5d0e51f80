"""The reports of a running session to the page, at torque level and at velocity level."""
