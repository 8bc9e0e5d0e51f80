"""Reads MuJoCo models (MJCF) and writes them as URDF."""
