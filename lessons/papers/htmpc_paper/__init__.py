"""Du, Zhou, Schoellig: Hierarchical Task MPC for Sequential Mobile Manipulation Tasks, RA-L 2024."""

from lessons.papers.htmpc_paper import delivery, squares, table_1, times, waypoints

ITEMS = (*table_1.ITEMS, *squares.ITEMS, *waypoints.ITEMS, *delivery.ITEMS, *times.ITEMS)
