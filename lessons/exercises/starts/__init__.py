"""The exercises' files with the hole in them; they run, and fail their checks."""
