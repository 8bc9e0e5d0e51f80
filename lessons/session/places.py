"""The indices of the fields that a torque-level session writes into a row of telemetry."""

from __future__ import annotations

from typing import NamedTuple

from himpc.telemetry import Layout


class Places(NamedTuple):
    """Where the fields that a session writes stand in a row; what the plant's M tells stands side by side."""

    t: int
    late: int
    truth: slice
    q: slice
    v: slice
    tau: slice
    q_measured: slice
    v_measured: slice

    @classmethod
    def of(cls, layout: Layout) -> Places:
        """Those of a layout."""
        fields = layout.fields
        start = fields["dynamic_leak"].start
        joints = (fields[name] for name in cls._fields[3:])
        return cls(fields["t"].start, fields["late"].start, slice(start, start + 3), *joints)
