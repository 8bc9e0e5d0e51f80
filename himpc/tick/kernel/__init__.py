"""What Numba compiles: the theory of one tick, a file per subject, on one arena of numbers."""
