"""The eigenvalues of I − M⁻¹M̄ beside the unit circle."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import viser

from app.html.palette import BAD, BOUND, GOOD, css
from app.html.svg import element, path, text
from app.link.messages import Inside
from app.panels.widgets.picture import SvgPicture
from app.tab.in_view import InView

TITLE = "Eigenvalues of I − M⁻¹M̄"
SIZE = (360, 208)
_MIDDLE, _RADIUS = (180.0, 92.0), 78.0
_EDGE = 2.2  # half the width of the picture, in radii of the unit circle


class SpectrumPicture:
    """The picture of the eigenvalues. It requests them while the browser shows the picture."""

    def __init__(self, client: viser.ClientHandle, in_view: InView) -> None:
        self._picture = SvgPicture(
            client, in_view, TITLE, SIZE, "Run (Space), or take one tick (T), to see the eigenvalues."
        )

    @property
    def in_view(self) -> bool:
        return self._picture.in_view

    def draw(self, inside: Inside | None) -> None:
        """Draws the eigenvalues that the simulation sent."""
        if inside is not None and inside.spectrum is not None and self.in_view:
            self._picture.paint([markup(inside.spectrum)])


def markup(values: np.ndarray | Sequence[float]) -> str:
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
    parts.append(text(x0, SIZE[1] - 18, verdict, "middle", font_weight=600))
    says = "Each tick multiplies each part of the error by its eigenvalue."
    parts.append(text(x0, SIZE[1] - 4, says, "middle"))
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
