"""What every test shares: one thread per matrix product, and the same examples in every run."""

from __future__ import annotations

import os

# Before NumPy is imported anywhere: the matrices are tiny, and threads only fight over the cores.
os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")

from hypothesis import settings

settings.register_profile("same-every-time", derandomize=True, deadline=None, database=None)
settings.load_profile("same-every-time")
