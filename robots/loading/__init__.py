"""Loads a robot from the catalog or from a URDF, and adds the data that its description lacks."""
