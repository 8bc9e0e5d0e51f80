"""The compiled functions of HTMPC: kinematics and clearances along a plan, rows, costs, and the QP method."""
