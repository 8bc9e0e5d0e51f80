"""Wang, Liu, Leibold, Buss, Lee: Hierarchical Incremental MPC for Redundant Robots, T-RO 2024."""

from lessons.papers.himpc_paper import (
    ablations,
    accuracy,
    adaptation,
    evidence,
    figures_circle,
    figures_conflict,
    figures_iiwa,
    limits,
    table_2,
    table_3,
    table_5,
    table_6,
    table_7,
    table_8,
    value,
)

ITEMS = (
    *table_2.ITEMS,
    *table_3.ITEMS,
    *table_5.ITEMS,
    *table_6.ITEMS,
    *table_7.ITEMS,
    *table_8.ITEMS,
    *figures_circle.ITEMS,
    *figures_conflict.ITEMS,
    *figures_iiwa.ITEMS,
    *accuracy.ITEMS,
    *value.ITEMS,
    *ablations.ITEMS,
    *limits.ITEMS,
    *evidence.ITEMS,
    *adaptation.ITEMS,
)
