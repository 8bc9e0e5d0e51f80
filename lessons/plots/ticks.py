"""Axis ticks at the values that were used."""

from __future__ import annotations

from collections.abc import Sequence

from matplotlib.axis import Axis
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, MaxNLocator, NullLocator

_FEW = 8


def label_values(axis: Axis, values: Sequence[float], log: bool) -> None:
    """Sets ticks at the values if there are few of them, otherwise at round numbers. The labels are plain
    numbers, without powers of ten."""
    if 0 < len(values) <= _FEW:
        axis.set_major_locator(FixedLocator(list(values)))
    elif not log and all(float(value).is_integer() for value in values):
        axis.set_major_locator(MaxNLocator(integer=True))
    elif log:
        axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:.3g}"))
    axis.set_minor_locator(NullLocator())
