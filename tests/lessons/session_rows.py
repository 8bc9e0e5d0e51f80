"""Reading a row of telemetry by name."""

from __future__ import annotations

import numpy as np

from lessons.session.torque import Session


def value(session: Session, row: np.ndarray, name: str) -> np.ndarray:
    return row[session.layout.fields[name]]
