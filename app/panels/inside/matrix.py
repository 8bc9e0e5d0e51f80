"""Pictures of matrices: the Hessian of one level's QP as a heat map, with marks at the active bounds, and the
eigenvalues of I − M⁻¹M̄ beside the unit circle."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
import viser

from app.html.palette import BAD, BOUND, GOOD, LEVELS, css, ink
from app.html.svg import element, path, text
from app.html.text import block, esc, figure, joint_labels
from app.link.messages import Inside
from app.panels.widgets.picture import SvgPicture
from app.tab.context import PageContext
from app.tab.in_view import InView

if TYPE_CHECKING:
    from lessons.geometry.matrix import Matrix

TITLE = "Hessian and active bounds"
SIZE = (400, 400)
_LEFT, _TOP, _SIDE = 62.0, 8.0, 330.0
_SHADES = 6
"""Number of shades for each sign, one for each power of ten."""


class MatrixPanel:
    """The heat map. It requests the Hessian while the browser shows the map."""

    def __init__(self, page: PageContext, levels: Sequence[str]) -> None:
        """levels: names, highest priority first."""
        self._names = joint_labels(page.robot.joint_names)
        self._level = page.gui.add_dropdown("Level", tuple(levels), initial_value=levels[0])
        self._picture = SvgPicture(
            page.client, page.in_view, TITLE, SIZE, "Run (Space), or take one tick (T), to see H."
        )
        self._words = page.gui.add_html("")

    @property
    def wish(self) -> str | None:
        """The level whose Hessian is requested; None while the picture is not visible."""
        return str(self._level.value) if self._picture.in_view else None

    def draw(self, inside: Inside | None) -> None:
        if inside is not None and inside.matrix is not None and self._picture.in_view:
            self._picture.paint([markup(inside.matrix, self._names)])

    def write(self, inside: Inside | None) -> None:
        """Updates the legend with the names of the bounds."""
        if inside is None or not self._picture.in_view:
            return
        words = block(esc(inside.why_not)) if inside.matrix is None else _legend(inside.matrix, self._names)
        self._words.content = words


def markup(matrix: Matrix, names: Sequence[str]) -> str:
    """Returns SVG of the heat map: cells coloured by sign and size, lines between knots, and a mark at every
    increment with an active bound."""
    k = len(matrix.shade)
    cell = _SIDE / k
    paths: dict[int, list[str]] = {}
    for row, values in enumerate(matrix.shade.tolist()):
        start = 0
        for column in range(1, k + 1):
            if column < k and _step(values[column]) == _step(values[start]):
                continue
            if step := _step(values[start]):
                x, y, wide = _LEFT + start * cell, _TOP + row * cell, (column - start) * cell
                paths.setdefault(step, []).append(f"M{x:.1f} {y:.1f}h{wide:.1f}v{cell:.1f}h{-wide:.1f}Z")
            start = column
    parts = [
        path("".join(pieces), fill=css(LEVELS[int(step > 0)], abs(step) / _SHADES))
        for step, pieces in sorted(paths.items())
    ]
    lines = "".join(
        f"M{_LEFT + at:.1f} {_TOP}v{_SIDE}M{_LEFT} {_TOP + at:.1f}h{_SIDE}"
        for at in (knot * matrix.joints * cell for knot in range(1, matrix.shown))
    )
    square: dict[str, Any] = {"x": _LEFT, "y": _TOP, "width": _SIDE, "height": _SIDE}
    parts.append(element("rect", **square, fill="none", stroke=css(BOUND)))
    parts += [path(lines, stroke=css(BOUND, 0.7)), _labels(matrix, names, cell)]
    for active in {(each.knot, each.joint) for each in matrix.active if each.knot < matrix.shown}:
        at = _TOP + (active[0] * matrix.joints + active[1] + 0.5) * cell
        x = _LEFT + at - _TOP
        arrows = path(f"M{_LEFT - 1} {at:.1f}l-8 -4v8Z") + path(f"M{x:.1f} {_TOP + _SIDE + 1}l-4 8h8Z")
        parts.append(element("g", arrows, class_="active", fill=css(BAD)))
        cross = f"M{_LEFT} {at:.1f}h{_SIDE}M{x:.1f} {_TOP}v{_SIDE}"
        parts.append(path(cross, stroke=css(BAD), stroke_width=0.8))
    return "".join(parts)


def _step(shade: int) -> int:
    size = -(-abs(shade) * _SHADES // 100)
    return size if shade > 0 else -size


def _labels(matrix: Matrix, names: Sequence[str], cell: float) -> str:
    """Labels of the rows and columns: the joints if only one knot is shown, otherwise the knots."""
    if matrix.shown == 1:
        size, words = cell, "joint by joint"
        short = [name if len(name) <= 8 else f"{joint + 1}" for joint, name in enumerate(names)]
        labels = [(name, name) for name in short]
    else:
        size, words = matrix.joints * cell, "knot by knot, and for each knot joint by joint"
        labels = [(f"Δτ, {knot}", f"{knot}") for knot in range(matrix.shown)]
    parts = [text(_LEFT + 0.5 * _SIDE, _TOP + _SIDE + 37, f"Δτ, {words}", "middle")]
    for k, (left, below) in enumerate(labels):
        at = (k + 0.5) * size
        parts.append(text(_LEFT - 12, _TOP + at + 4, left, "end"))
        parts.append(text(_LEFT + at, _TOP + _SIDE + 21, below, "middle"))
    return "".join(parts)


def _legend(matrix: Matrix, names: Sequence[str]) -> str:
    held = "".join(
        f"<br><b>{esc(names[each.joint])}</b>: {esc(each.kind)}, {'upper' if each.upper else 'lower'} bound, "
        f"from increment {each.knot} on; multiplier {figure(each.multiplier)}"
        for each in sorted(matrix.active, key=lambda each: -each.multiplier)[:8]
    )
    more = len(matrix.active) - 8
    size = matrix.knots * matrix.joints
    return block(
        f"H = GᵀQG + R of level <b>{esc(matrix.level)}</b>, {size} × {size}"
        + (f" (the first {matrix.shown} of {matrix.knots} knots)" if matrix.shown < matrix.knots else "")
        + f". Blue: positive; orange: negative. The shade shows the size, over six powers of ten below "
        f"{figure(matrix.largest)}. Largest eigenvalue / smallest: {figure(matrix.condition)}.<br>"
        + (f'<b style="color:{ink(BAD)}">Red: active bounds</b>{held}' if held else "No bound is active.")
        + (f"<br>… and {more} more." if more > 0 else "")
    )


EIGENVALUES = "Eigenvalues of I − M⁻¹M̄"
_SPECTRUM_SIZE = (360, 208)
_MIDDLE, _RADIUS = (180.0, 92.0), 78.0
_EDGE = 2.2  # half the width of the picture, in radii of the unit circle


class SpectrumPicture:
    """The picture of the eigenvalues. It requests them while the browser shows the picture."""

    def __init__(self, client: viser.ClientHandle, in_view: InView) -> None:
        self._picture = SvgPicture(
            client,
            in_view,
            EIGENVALUES,
            _SPECTRUM_SIZE,
            "Run (Space), or take one tick (T), to see the eigenvalues.",
        )

    @property
    def in_view(self) -> bool:
        return self._picture.in_view

    def draw(self, inside: Inside | None) -> None:
        if inside is not None and inside.spectrum is not None and self.in_view:
            self._picture.paint([spectrum_markup(inside.spectrum)])


def spectrum_markup(values: np.ndarray | Sequence[float]) -> str:
    """Returns SVG with a mark for each eigenvalue; all eigenvalues are real. Marks outside the picture are
    drawn at its edge. The attribute data-at contains the value."""
    x0, y0 = _MIDDLE
    far, high = _EDGE * _RADIUS, _RADIUS + 8
    axes = f"M{x0 - far:.0f} {y0}H{x0 + far:.0f}M{x0} {y0 - high}v{2 * high}"
    parts = [
        element("circle", cx=x0, cy=y0, r=_RADIUS, fill=css(GOOD, 0.08), stroke=css(BOUND)),
        path(axes, stroke=css(BOUND, 0.6)),
        text(x0 - _RADIUS - 5, y0 + 14, "−1", "end"),
        text(x0 + _RADIUS + 5, y0 + 14, "1"),
        text(x0 - 4, y0 + 14, "0", "end"),
    ]
    known = [float(value) for value in values if math.isfinite(value)]
    parts += [
        element(
            "circle",
            class_="eigenvalue",
            data_at=f"{value:.6g}",
            cx=x0 + _RADIUS * min(max(value, -_EDGE), _EDGE),
            cy=y0,
            r=4.5,
            fill=css(GOOD if abs(value) < 1.0 else BAD, 0.75),
            stroke="currentColor",
            stroke_width=0.7,
        )
        for value in known
    ]
    verdict = _verdict(max(known, key=abs, default=math.nan))
    parts.append(text(x0, _SPECTRUM_SIZE[1] - 18, verdict, "middle", font_weight=600))
    says = "Each tick multiplies each part of the error by its eigenvalue."
    parts.append(text(x0, _SPECTRUM_SIZE[1] - 4, says, "middle"))
    return "".join(parts)


def _verdict(worst: float) -> str:
    figure = f"{worst:.3g}".replace("-", "−")
    if math.isnan(worst):
        return "not finite"
    if worst < -1.0:
        return f"{figure}: the error grows and changes sign at every tick"
    if worst >= 1.0:
        return f"{figure}: the error does not decay"
    return f"largest {figure}: " + ("slow" if worst > 0 else "the sign changes at every tick")
