"""Finds the scenes and tasks of a run, by name or by the path of a file; files are tested first."""
