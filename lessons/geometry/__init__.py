"""The geometry of one tick: what its QPs look like, as plain data to draw."""
