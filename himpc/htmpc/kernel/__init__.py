"""What Numba compiles of HTMPC: kinematics and clearances along a plan, rows, costs, and the QPs' method."""
