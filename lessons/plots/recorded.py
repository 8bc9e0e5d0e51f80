"""The picture of a recorded run: errors, joints inside their bounds, and the time the controller took."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from himpc.telemetry import Layout
from lessons.plots.panels import Panel, Picture, PlotCurve
from robots.arrays import Array

_FLOOR = 1e-3  # mm or °


@dataclass(frozen=True, eq=False)
class Recorded:
    """Rows of a run, (k, size), and the layout of their fields."""

    layout: Layout
    rows: Array

    def __getitem__(self, field: str) -> Array:
        return self.rows[:, self.layout.fields[field]]


def run_picture(name: str, run: Recorded, ghost: Recorded | None, T_s: float) -> Picture:
    """Returns the plots of the page, over the whole recording.

    Args:
        name: file name without ending.
        run: the recorded run.
        ghost: the recorded ghost, drawn dashed in the same colours.
        T_s: s, the budget of a control step.
    """
    both = [(run, "line")] if ghost is None else [(run, "line"), (ghost, "dashed")]
    panels = [
        Panel("error (mm or °)", tuple(c for run, style in both for c in _errors(run, style)), log_y=True),
        *(
            Panel(
                f"{words} (% of bound)",
                tuple(c for run, style in both for c in _shares(run, style, field, lower, upper)),
                bounds=(-100.0, 100.0),
            )
            for words, field, lower, upper in (
                ("torque", "tau", "tau_lower", "tau_upper"),
                ("velocity", "v", "", "v_limit"),
                ("position", "q", "q_lower", "q_upper"),
            )
            if upper in run.layout.fields
        ),
        Panel(
            "control step (ms)",
            tuple(
                PlotCurve(run["t"][:, 0], 1e-3 * run["step_us"][:, 0], "control step", "7", style)
                for run, style in both
            ),
            bounds=(1e3 * T_s,),
            log_y=True,
        ),
    ]
    dashed = "" if ghost is None else " Dashed: the ghost."
    return Picture(name, f"A run recorded on the page.{dashed}", tuple(panels))


def _errors(run: Recorded, style: str) -> list[PlotCurve]:
    curves: list[PlotCurve] = []
    for index, task in enumerate(run.layout.tasks):
        unit, factor = ("mm", 1e3) if task.unit == "m" else ("°", 180 / np.pi)
        # Smaller errors are cut, because they would extend the logarithmic axis too far.
        size = np.maximum(factor * np.linalg.norm(run[f"error/{task.name}"], axis=1), _FLOOR)
        label = f"{task.name} ({unit})" + (", ghost" if style == "dashed" else "")
        curves.append(PlotCurve(run["t"][:, 0], size, label, str(index), style))
    return curves


def _shares(run: Recorded, style: str, field: str, lower: str, upper: str) -> list[PlotCurve]:
    high = run[upper]
    low = run[lower] if lower else -high
    with np.errstate(all="ignore"):
        shares = 100 * (run[field] - 0.5 * (high + low)) / (0.5 * (high - low))
    return [
        PlotCurve(run["t"][:, 0], shares[:, joint], name if style == "line" else "", str(joint), style)
        for joint, name in enumerate(run.layout.joints)
        if np.isfinite(shares[:, joint]).any()
    ]
