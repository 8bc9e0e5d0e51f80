"""From settings to the optimisation problems of a control period: the settings, the levels prepared for them,
and what is remembered from the period before. The printed route and the compiled one share it."""
