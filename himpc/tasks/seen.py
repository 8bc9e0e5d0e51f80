"""Converts a reference to the coordinates of a task, if these coordinates depend on the motion of robot and
target."""

from __future__ import annotations

import numpy as np

from himpc.references.preview import Preview
from robots.arrays import Array

NUDGE = 1e-4
"""Time step of the central difference of G along the motion, to each side, s."""


def rests(preview: Preview) -> bool:
    """Returns whether the target is at rest over the horizon."""
    return not (preview.displacement.any() or preview.velocity.any() or preview.acceleration.any())


def at_rest(preview: Preview, m: int) -> Preview:
    """Returns the preview of a target at rest, with m coordinates."""
    zero = np.zeros((len(preview.displacement), m))
    return Preview(preview.value, zero, zero, zero)


def seen(preview: Preview, motion: tuple[Array, Array, Array], G: Array, change: Array) -> Preview:
    """Returns ẋ_d = G ẏ_d and ẍ_d = G ÿ_d + Ġ ẏ_d of a target y_d, and x_d(k+j) − x_d(k) by the trapezoidal
    rule.

    Args:
        preview: preview of the target.
        motion: displacement, velocity and acceleration of the target, (N+1, 3) each.
        G: (N+1, m, 3), the matrix at every knot.
        change: Ġ, (N+1, m, 3), along the motion of robot and target.
    """
    displacement, velocity, acceleration = (samples[:, :, None] for samples in motion)
    gone = np.zeros(G.shape[:2])
    gone[1:] = (0.5 * (G[1:] + G[:-1]) @ np.diff(displacement, axis=0))[:, :, 0].cumsum(axis=0)
    return Preview(
        preview.value, gone, (G @ velocity)[:, :, 0], (G @ acceleration + change @ velocity)[:, :, 0]
    )
