"""Loading: a robot from the catalog or from a URDF, with the data that its description lacks."""
