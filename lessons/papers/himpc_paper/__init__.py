"""Wang, Liu, Leibold, Buss, Lee: Hierarchical Incremental MPC for Redundant Robots, T-RO 2024."""

from lessons.papers.himpc_paper import (
    ablations,
    adaptation,
    evidence,
    figures_iiwa,
    figures_planar,
    iiwa,
    limits,
    planar,
    theory,
)

_PARTS = (planar, iiwa, figures_planar, figures_iiwa, theory, ablations, limits, evidence, adaptation)
ITEMS = tuple(item for part in _PARTS for item in part.ITEMS)
