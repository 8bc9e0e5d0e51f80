"""Functions that read a row of telemetry by name."""

from __future__ import annotations

import numpy as np

from lessons.session.torque import TorqueSession


def value(session: TorqueSession, row: np.ndarray, name: str) -> np.ndarray:
    return row[session.layout.fields[name]]


def rows_of(session: TorqueSession, ticks: int) -> np.ndarray:
    return np.array([session.tick().copy() for _ in range(ticks)])


def field(session: TorqueSession, rows: np.ndarray, name: str) -> np.ndarray:
    return rows[:, session.layout.fields[name]]
