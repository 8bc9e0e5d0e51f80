"""Panels that show the inside of one tick; what nobody has open costs nothing."""
