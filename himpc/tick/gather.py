"""Finds the numbers of a telemetry row in an arena."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from himpc.tasks import Damping, FrameOrientation
from himpc.telemetry import Layout
from himpc.tick.configure import Span, is_built_in
from himpc.tick.kernel.arena import Arena
from himpc.tick.kernel.arrays import AT, IntArray

_LIMITS = ("tau_lower", "tau_upper", "v_limit", "", "", "", "q_lower", "q_upper")
"""Telemetry fields of the rows of `limits`; an empty name means that the row (stops, decelerations) has no
field."""


def gathered(arena: Arena, layout: Layout, spans: Sequence[Span], levels: Sequence[str]) -> IntArray | None:
    """Returns an index into `arena.data` for every field of a row. It is the index of the field's number if a
    plan or its references fill the field, otherwise the index of a NaN.

    Args:
        arena: the arena of a controller.
        layout: the layout of the row.
        spans: index, task and rows of every task.
        levels: names of the levels that are solved.

    Returns:
        (size,), or None if the row has a task whose reference is not in the arena.
    """
    sources = np.full(layout.size, arena.where[AT["nothing"]])
    n, fields, knots = len(layout.joints), layout.fields, arena.f["motion"][0].size

    def put(field: str, name: str, skipped: int = 0) -> None:
        where = fields[field]
        start = arena.where[AT[name]] + skipped
        sources[where] = np.arange(start, start + where.stop - where.start)

    for name in ("delta_tau", "at_bound", "priority_leak", "tau_0"):
        put(name, name)
    put("tau_demand", "tau")
    for index, field in enumerate(_LIMITS):
        if field:
            put(field, "limits", index * n)
    known = {task.name: (index, task, span.start) for index, task, span in spans}
    for info in layout.tasks:
        index, task, first = known.get(info.name, (0, None, 0))
        if task is None or isinstance(task, Damping) or not is_built_in(task):
            return None
        if isinstance(task, FrameOrientation):
            put(f"x/{info.name}", "quaternion", 4 * index)
            put(f"x_d/{info.name}", "quaternion_d", 4 * index)
        else:
            put(f"x/{info.name}", "value", first)
            put(f"x_d/{info.name}", "x_d", first)
        put(f"error/{info.name}", "error", first)
        for which, field in ((1, "v_d"), (2, "a_d")):
            put(f"{field}/{info.name}", "motion", which * knots + first)
    for index, level in enumerate(levels):
        for field in ("cost", "kkt", "fallback", "time_us", "leak", "active"):
            put(f"{field}/{level}", field, index)
    return sources
