"""The geometry of a robot as data: the solids for contacts, and the capsules for distances."""
