"""The value function V_N(k) of section IV-B along a run, and how it decreases, (39)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from lessons.experiments.jobs import Job, JobResult, Results
from lessons.papers.item import Item, PaperCheck, Section
from lessons.papers.words import number, trouble
from lessons.plots.panels import Panel, Picture, PlotCurve
from lessons.scenes.run_spec import RunSpec

Array = NDArray[np.float64]

_JOB = Job(RunSpec("iiwa14-circle", controller="himpc", duration=1.5))
"""The run starts from rest, but the reference starts with a velocity, so that V_N begins far above its final
value."""
_LEVELS = ("position", "orientation", "q1")
_SETTLED_AFTER = 1.0
_FAR = 10.0
"""V_N above this many times ε_N counts as far from the reference."""


def decrease(V: Array, t: Array) -> tuple[float, float]:
    """Returns (ε_N, α) with V(k+1) − V(k) ≤ −α V(k) + ε_N on all ticks far from the reference, see (39).

    ε_N is the largest value after V has settled. α is the largest value for which (39) holds with this ε_N at
    all ticks before, as long as V > 10 ε_N. If α > 0, V decreases there. Without such ticks α is NaN.
    """
    late = V[t >= _SETTLED_AFTER]
    if not len(late):
        return float("nan"), float("nan")
    epsilon = float(late.max())
    ends = np.flatnonzero(_FAR * epsilon >= V)
    first = int(ends[0]) if len(ends) else len(V) - 1
    if first < 2:
        return epsilon, float("nan")
    far = V[: first + 1]
    return epsilon, float(((far[:-1] - far[1:] + epsilon) / far[:-1]).min())


def _section(results: Results, quick: bool) -> Section:
    run = results[_JOB]
    epsilon, alpha = decrease(run.column("cost/position"), run.t)
    curves = tuple(_value(run, level, k) for k, level in enumerate(_LEVELS))
    V = run.column("cost/position")
    ratio = PlotCurve(V[:-1], V[1:] / V[:-1], "level 1", "0", "dots") if len(V) else PlotCurve(V, V)
    panels = (
        Panel("$V_N(k)$", curves, log_y=True),
        Panel(
            "$V_N(k+1) / V_N(k)$, level 1",
            (ratio,),
            "$V_N(k)$, level 1",
            title="below 1 it decreases",
            bounds=(1.0,),
            log_x=True,
            y_range=(0.0, 2.0),
        ),
    )
    caption = (
        "Value functions of the three levels from rest on RT4, and the ratio of successive values for level "
        "1. The value of level 3 rises: its reference is faster than joint 1 is allowed to turn, and (39) "
        "guarantees nothing for lower levels."
    )
    return Section(
        notes=(
            "V_N(k) is the optimal cost of each level, from the telemetry. By (39), the cost of level 1 must "
            "decrease as long as it is far above the bound ε_N that the estimation error leaves. The cost of "
            "a lower level decreases only as far as level 1 permits. "
            f"ε_N = {number(epsilon)}. {trouble(run)}",
        ),
        checks=(
            PaperCheck(
                f"level 1, ticks with V_N above {_FAR:g} ε_N: least α of (39) > 0",
                alpha,
                bool(alpha > 0),
            ),
        ),
        pictures=(Picture("himpc-value", caption, panels),),
    )


def _value(run: JobResult, level: str, index: int) -> PlotCurve:
    return PlotCurve(run.t, run.column(f"cost/{level}"), f"level {index + 1}", str(index))


ITEMS = (
    Item(
        "himpc-value",
        "The value function of level 1 decreases",
        "HIMPC (T-RO 2024), section IV-B, (37) to (39)",
        lambda quick: (_JOB,),
        _section,
    ),
)
