"""Du, Zhou, Schoellig: Hierarchical Task MPC for Sequential Mobile Manipulation Tasks, RA-L 2024."""

from lessons.papers.htmpc_paper import missions, squares, table_1, times

ITEMS = (*table_1.ITEMS, *squares.ITEMS, *missions.ITEMS, *times.ITEMS)
