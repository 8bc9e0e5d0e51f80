"""The geometry of a robot as data: the solids that touch, and the capsules whose distances are kept."""
