"""The files of the exercises, with missing lines. The files run, but do not pass their checks."""
