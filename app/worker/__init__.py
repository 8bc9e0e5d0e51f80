"""The simulation process: the session that runs, its pacing, leader and ghost."""
