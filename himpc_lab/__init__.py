"""himpc-lab in a notebook: `lab = himpc_lab.show("iiwa14-hold")` shows the page in the cell."""

from app.jupyter.lab import Lab, show

__all__ = ["Lab", "show"]
