"""The page: one simulation process per browser, the 3D view and the panels. The only door to viser."""

import os

# One thread per matrix product: the matrices are tiny, and every session has its own process. NumPy reads it
# once, when it is imported, so it stands before every other import.
for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ.setdefault(_name, "1")
