"""Measurements that are not part of the tests. `python -m benchmarks.NAME` runs a measurement in a
checkout."""
