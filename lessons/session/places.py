"""The indices of the fields that a torque-level session writes into a row of telemetry."""

from __future__ import annotations

from typing import NamedTuple

from himpc.telemetry import Layout


class Places(NamedTuple):
    """The indices of the fields that a session writes into a row; values that need the plant's M are
    adjacent, as are depth and force of a contact, and a distance and what is kept of it."""

    t: int
    late: int
    truth: slice
    touch: slice
    near: slice
    q: slice
    v: slice
    tau: slice
    q_measured: slice
    v_measured: slice

    @classmethod
    def of(cls, layout: Layout) -> Places:
        """The indices in a layout."""
        fields = layout.fields
        start, felt = fields["dynamic_leak"].start, fields["contact_depth"].start
        joints = (fields[name] for name in cls._fields[5:])
        near = fields["distance"].start
        truth, touch, apart = slice(start, start + 3), slice(felt, felt + 2), slice(near, near + 2)
        return cls(fields["t"].start, fields["late"].start, truth, touch, apart, *joints)
