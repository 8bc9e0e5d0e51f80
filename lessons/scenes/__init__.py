"""Robot, stack, reference and disturbances as data, both kinds in one catalog."""
