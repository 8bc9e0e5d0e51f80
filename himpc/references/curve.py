"""References that are described by a few coefficients, from which the compiled kernel computes them without
Python."""

from __future__ import annotations

from typing import NamedTuple

from himpc.references.curves import Circle, FigureEight, Sinusoid
from himpc.references.hold import Hold
from himpc.references.phase import Phase
from himpc.references.preview import Array, Reference


class Curve(NamedTuple):
    """x_d = c + a cos φ + b sin φ + d sin 2φ.

    Attributes:
        centre: c, (m,); or a constant rotation matrix.
        swing: a, b and d, each (m,) or 0.
        phase: time law φ(t); None: x_d is constant at `centre`.
    """

    centre: Array
    swing: tuple[Array | float, Array | float, Array | float] = (0.0, 0.0, 0.0)
    phase: Phase | None = None


def curve_of(reference: Reference) -> Curve | None:
    """Returns the coefficients of a reference; None for a reference that can only be sampled by `preview`."""
    match reference:
        case Hold():
            return Curve(reference.value)
        case Circle():
            return Curve(reference.centre, (reference.u, reference.w, 0.0), reference.phase)
        case FigureEight():
            return Curve(reference.centre, (0.0, reference.u, 0.5 * reference.w), reference.phase)
        case Sinusoid():
            return Curve(reference.offset, (0.0, reference.amplitude, 0.0), reference.phase)
        case _:
            return None
