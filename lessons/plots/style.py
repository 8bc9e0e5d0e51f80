"""One style for all pictures: each controller has the same colour everywhere, on the screen and in print."""

from __future__ import annotations

from typing import Any

CONTROLLER_COLOURS: dict[str, str] = {
    "himpc": "#0057B8",
    "hiqp": "#7B3FA0",
    "nhimpc": "#56B4E9",
    "osf": "#8C6D31",
    "tdeosf": "#009E73",
    "hqp": "#E07A00",
    "weighted": "#C2185B",
    "himpc_filtered": "#444444",
    "htmpc": "#0057B8",
    "htmpc_wpt": "#56B4E9",
    "stmpc": "#E07A00",
    "htidkc": "#009E73",
    "placo": "#C2185B",
}
"""Colours that can be distinguished with the common colour-vision deficiencies and, by lightness, in grey
print."""

NAMES: dict[str, str] = {
    "himpc": "HIMPC",
    "hiqp": "HIQP",
    "nhimpc": "NHIMPC",
    "osf": "OSF",
    "tdeosf": "TDEOSF",
    "hqp": "HQP",
    "weighted": "weighted",
    "himpc_filtered": "HIMPC, filtered",
}
"""Controllers as the paper writes them."""

SEQUENCE = ("#0057B8", "#E07A00", "#009E73", "#C2185B", "#56B4E9", "#8C6D31", "#7B3FA0", "#444444")
REFERENCE = "#222222"
BOUND = "#8B95A1"

RC: dict[Any, Any] = {
    "font.family": "DejaVu Sans",
    "font.size": 9,
    "axes.titlesize": 9,
    "axes.labelsize": 9,
    "legend.fontsize": 9,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.grid": True,
    "grid.color": "#E3E6EA",
    "grid.linewidth": 0.6,
    "axes.edgecolor": "#5C6670",
    "axes.linewidth": 0.8,
    "legend.frameon": False,
    "axes.formatter.limits": (-3, 4),
    "axes.formatter.use_mathtext": True,
}


def colour(key: str) -> str:
    """Returns the colour of a controller, "reference" or a place in the sequence."""
    if key == "reference":
        return REFERENCE
    if key.isdigit():
        return SEQUENCE[int(key) % len(SEQUENCE)]
    return CONTROLLER_COLOURS[key]


def name(controller: str) -> str:
    """Returns a controller's name as the paper writes it."""
    return NAMES.get(controller, controller)
