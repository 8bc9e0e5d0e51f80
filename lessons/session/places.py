"""The indices of the fields that a torque-level session writes into a row of telemetry."""

from __future__ import annotations

from typing import NamedTuple

from himpc.telemetry import Layout


class Places(NamedTuple):
    """The indices of the fields that a session writes into a row. `truth` is the first of three adjacent
    values that need the plant's M; `touch` is the depth of a contact, and the next value its force; `near` is
    the distance of the nearest pair, and the next value the distance that it must keep."""

    t: int
    late: int
    truth: int
    touch: int
    near: int
    q: slice
    v: slice
    tau: slice
    q_measured: slice
    v_measured: slice
    v_limit: slice
    v_limit_lowered: slice

    @classmethod
    def of(cls, layout: Layout) -> Places:
        """Returns the indices in a layout."""
        fields = layout.fields
        numbers = (fields[name].start for name in ("t", "late", "dynamic_leak", "contact_depth", "distance"))
        return cls(*numbers, *(fields[name] for name in cls._fields[5:]))
