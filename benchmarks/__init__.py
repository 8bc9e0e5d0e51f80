"""Measurements, which are no part of the tests. `python -m benchmarks.NAME` runs one in a checkout."""
