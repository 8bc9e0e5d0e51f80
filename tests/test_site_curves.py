"""Curves of the site keep their peaks when they are thinned, and have an axis that suits their values."""

from __future__ import annotations

import re
from typing import Any

import numpy as np
import pytest

from app.html.svg import tick_label as label
from app.worker.lecturer import BUCKETS, thinned
from docs.pages.curves import FLOORS, figure


def test_a_peak_is_neither_lost_nor_moved() -> None:
    """A value of one tick far above the curve, one far below it, and both ends are kept, each at its own
    time."""
    t = np.linspace(0.0, 8.0, 8000)
    y = np.sin(t)
    y[[1234, 6543]] = 5.0, -5.0
    times, values = thinned(t, y)
    assert len(times) == len(values) <= 2 * BUCKETS + 2
    assert (np.diff(times) > 0).all()
    assert (times[0], times[-1]) == (t[0], t[-1])
    for place in (1234, 6543):
        assert values[times == t[place]] == y[place]
    assert np.abs(np.interp(t, times, values) - y)[:1200].max() < 0.02


def test_what_is_not_known_stays_a_gap() -> None:
    t = np.linspace(0.0, 1.0, 1000)
    y = np.where(t < 0.5, np.nan, t)
    times, values = thinned(t, y)
    assert np.nanmin(values) == pytest.approx(0.5, abs=2e-3)
    assert np.isnan(values[times < 0.45]).all()


def drawn(values: list[float], unit: str) -> str:
    """Returns the plot of one curve as SVG text."""
    plot: dict[str, Any] = {"words": "error", "unit": unit, "t": [[0.1 * k for k in range(len(values))]]}
    return figure({"plots": [{**plot, "curves": [values]}]}, None)


@pytest.mark.parametrize("unit", FLOORS)
def test_a_logarithmic_axis_ends_where_only_rounding_is_left(unit: str) -> None:
    """The caption names the value at which the axis ends."""
    floor = FLOORS[unit]
    text = drawn([1e4 * floor * 10.0 ** (-k) for k in range(20)], unit)
    end = f"{label(floor, log=True)} {unit}"
    assert f"Below {end} a curve is drawn at {end}." in text
    heights = [float(y) for y in re.findall(r"[ML][\d.]+ ([\d.]+)", text.partition('class="own"')[2])]
    assert heights == sorted(heights)
    assert len(set(heights)) == 5


def test_an_error_that_starts_at_zero_has_an_ordinary_axis() -> None:
    """A single value at rounding level does not make the axis logarithmic."""
    text = drawn([1e-15, *np.linspace(0.5, 16.0, 99).tolist()], "deg")
    assert "Below" not in text and ">10</text>" in text and ">5</text>" in text


def test_a_curve_that_spans_decades_has_a_logarithmic_one() -> None:
    text = drawn(np.logspace(0, 8, 60).tolist(), "%")
    assert ">10⁸</text>" in text and "Below" not in text
