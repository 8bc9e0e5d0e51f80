"""Measurements, as opposed to tests: run `python -m benchmarks.NAME` in a checkout."""
