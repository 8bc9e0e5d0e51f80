"""Section VI, the iiwa on RT4: the runs that its tables and figures share."""

from __future__ import annotations

from lessons.experiments.jobs import Job
from lessons.scenes.run_spec import RunSpec

RT4, RT4_DATA_SHEET = "iiwa14-circle-paper", "iiwa14-circle"
SOURCE = "HIMPC (T-RO 2024), section VI"
DISTURBED = "[0.8,0.8,1.2,1.2,0.8,1.2,1.2]"
"""Section VI-B: each diagonal element reduced or increased by 20 %, in the order − − + + − + +."""
_LEVELS = (
    ("position", ("x", "y", "z"), "m"),
    ("orientation", ("o_X", "o_Y", "o_Z"), "deg"),
    ("q1", ("q₁",), "deg"),
)
COORDINATES = tuple(
    (label, task, k, unit) for task, labels, unit in _LEVELS for k, label in enumerate(labels)
)
"""(label, task, its coordinate, unit) of the seven columns of Table V."""
OPEN = (
    "The paper does not print the plant's inertias, gravity, friction, integrator or start; "
    f"`{RT4}` is our best reading."
)


def rt4(controller: str = "himpc", *assignments: str, seconds: float | None = None) -> Job:
    """Returns the run of RT4 for 4 s, most likely with the settings of the paper."""
    return Job(RunSpec(RT4, controller=controller, set=assignments, duration=seconds))
