"""Panels that show the inside of one tick. The simulation computes their data only while they are visible."""
