"""The geometry of the QPs of one tick, as plain data to draw."""
