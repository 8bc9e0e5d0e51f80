"""From settings to the optimisation problems of a control period: the settings, the levels prepared for them,
and the memory of the previous period. The printed page and the kernel share this package."""
