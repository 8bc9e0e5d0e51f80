"""The page's side of a simulation: its reports, its learner and its ghost."""
