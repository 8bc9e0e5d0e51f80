"""The page's side of a simulation: the reports, the learner and the ghost."""
