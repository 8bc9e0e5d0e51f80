"""Variants of HTMPC without priorities, without coordination or without a preview."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from himpc.htmpc.htmpc import HTMPC
from himpc.htmpc.plan import VelocityPlan
from himpc.references import Preview
from himpc.references.hold import still
from himpc.stack import Stack

Array = NDArray[np.float64]


class STMPC(HTMPC):
    """Single-task MPC: (9) for the first enabled level of the stack. All other levels are ignored."""

    def _chosen(self, enabled: Stack) -> Stack:
        return enabled[:1]


class HTMPC_WPT(HTMPC):
    """HTMPC without a preview (section V-C): every reference is a waypoint, constant at its present value."""

    def step(self, q: Array, v: Array, previews: Mapping[str, Preview]) -> VelocityPlan:
        return super().step(q, v, {name: _frozen(preview) for name, preview in previews.items()})


def _frozen(preview: Preview) -> Preview:
    knots, m = preview.displacement.shape
    rest = still(knots - 1, m)
    return Preview(preview.value, rest.displacement, rest.velocity, rest.acceleration)
