"""The 3D scene of one page."""
