"""What a run names is found: scenes and tasks by name, or by the path of a file, which is tried first."""
