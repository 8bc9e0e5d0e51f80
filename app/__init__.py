"""The page: one simulation process per browser, the 3D view and the panels. The only door to viser."""
