"""The simulation process: the running session and its pacing, the leader and the ghost."""
