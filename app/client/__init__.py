"""The page's side of a simulation: what it was told, a learner, a ghost."""
