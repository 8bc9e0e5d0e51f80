"""The headless loop of one run, at torque and at velocity level."""
