"""Panels that show the inside of one tick. The simulation computes the data of a panel only while it is
visible."""
