"""The simulation's side: the body that runs, pacing, leader and ghost."""
