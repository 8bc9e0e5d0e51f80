"""The picture of a sweep: a heat map over two settings, a curve over one."""

from __future__ import annotations

from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colors import LogNorm, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from lessons.outputs import write_files
from lessons.plots.draw import label_values, png
from lessons.plots.style import RC
from robots.arrays import Array, Mask

_HATCHED: dict[str, Any] = {"edgecolor": "#B3261E", "linewidth": 0.0}
_LOST = {"facecolor": "#F3D9D6", "hatch": "////", **_HATCHED}
_FAILED = {"facecolor": "#D5D9DE", "hatch": "xxxx", **_HATCHED}


class SweepMap(NamedTuple):
    """One or two swept settings, and a quantity of every cell.

    Attributes:
        title, metric: the headline, and the quantity that colour or curve shows, with its unit.
        labels, values, log: per axis: the path, its values, and whether the values have equal ratios.
        z: the quantity, (n,) or (n_1, n_2); NaN for a cell without a value.
        diverged, failed: cells that lost control, and cells that could not be run; same shape as z.
    """

    title: str
    metric: str
    labels: tuple[str, ...]
    values: tuple[tuple[float, ...], ...]
    log: tuple[bool, ...]
    z: Array
    diverged: Mask
    failed: Mask

    @property
    def marks(self) -> tuple[tuple[str, Mask, dict[str, Any]], ...]:
        """The names, masks and styles of the cells without a value."""
        return ("control lost", self.diverged, _LOST), ("could not be run", self.failed, _FAILED)


def draw_map(path: Path, swept: SweepMap) -> None:
    """Draws a sweep as a PNG file."""
    with mpl.rc_context(RC):
        figure = Figure(figsize=(7.2, 5.0 if swept.z.ndim == 2 else 3.4), dpi=150, layout="constrained")
        FigureCanvasAgg(figure)
        axes = figure.subplots()
        axes.set_title(swept.title)
        if swept.z.ndim == 2:
            _two(figure, axes, swept)
        else:
            _one(axes, swept)
        handles = [Patch(label=name, **how) for name, mask, how in swept.marks if mask.any()]
        if handles:
            figure.legend(handles=handles, loc="outside lower center", ncols=2)
        write_files({path: png(figure)})


def _norm(z: Array) -> Normalize:
    """Logarithmic colours if the values are positive and span more than a decade."""
    known = z[np.isfinite(z)]
    if known.size and known.min() > 0 and known.max() > 10 * known.min():
        return LogNorm(known.min(), known.max())
    return Normalize(known.min(), known.max()) if known.size else Normalize(0, 1)


def _edges(values: tuple[float, ...], log: bool) -> Array:
    """Borders of the cells: halfway between two values, in ratio if `log`."""
    centres = np.log(values) if log else np.array(values)
    if len(centres) == 1:
        half = 0.5 * (abs(centres[0]) or 1.0)
        edges = np.array([centres[0] - half, centres[0] + half])
    else:
        inner = 0.5 * (centres[1:] + centres[:-1])
        edges = np.r_[2 * centres[0] - inner[0], inner, 2 * centres[-1] - inner[-1]]
    return np.exp(edges) if log else edges


def _two(figure: Figure, axes: Axes, swept: SweepMap) -> None:
    log, z = swept.log, swept.z
    x, y = (_edges(axis, is_log) for axis, is_log in zip(swept.values, log, strict=True))
    shown = axes.pcolormesh(x, y, np.ma.masked_invalid(z.T), norm=_norm(z), cmap="viridis_r", rasterized=True)
    for _, mask, how in swept.marks:
        for i, j in np.argwhere(mask):
            axes.fill([x[i], x[i + 1], x[i + 1], x[i]], [y[j], y[j], y[j + 1], y[j + 1]], **how)
    axes.set(xscale="log" if log[0] else "linear", yscale="log" if log[1] else "linear")
    label_values(axes.xaxis, swept.values[0], log[0])
    label_values(axes.yaxis, swept.values[1], log[1])
    axes.set(xlabel=swept.labels[0], ylabel=swept.labels[1], xlim=(x[0], x[-1]), ylim=(y[0], y[-1]))
    axes.grid(visible=False)
    figure.colorbar(shown, ax=axes, label=swept.metric)


def _one(axes: Axes, swept: SweepMap) -> None:
    values, log, z = swept.values[0], swept.log[0], swept.z
    edges = _edges(values, log)
    axes.plot(values, z, "-o", color="#0057B8", markersize=4, linewidth=1.2, zorder=3)
    for _, mask, how in swept.marks:
        for i in np.flatnonzero(mask):
            axes.axvspan(float(edges[i]), float(edges[i + 1]), **how)
    axes.set_xscale("log" if log else "linear")
    label_values(axes.xaxis, values, log)
    if isinstance(_norm(z), LogNorm):
        axes.set_yscale("log")
    axes.set(xlabel=swept.labels[0], ylabel=swept.metric, xlim=(edges[0], edges[-1]))
