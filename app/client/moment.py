"""The data that the page shows: one instant of a run, at most a minute old, with the ghost at that time."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from app.client.recording import PlotWindow, Recording
from app.client.simulation_client import GhostClient, SimulationClient
from app.link.messages import Status

TRACE_SECONDS = 6.0
_FAR = 0.5  # s; the picture does not wait for a ghost that lags by more than this


@dataclass(frozen=True, eq=False)
class GhostState:
    """The ghost at an instant; see `Moment`."""

    poses: np.ndarray
    window: PlotWindow
    way: np.ndarray


@dataclass(frozen=True, eq=False)
class Moment:
    """One instant of a run.

    Attributes:
        t: s.
        live: whether this is the present instant.
        poses: (J, 7) poses of joints and tip, position (m) and quaternion wxyz.
        status: the newest report at that instant.
        latest: the newest row of telemetry at that instant.
        window: the curves of the plots.
        way: (k, J, 7) poses of the last TRACE_SECONDS, oldest first.
        ghost: the ghost at that instant; None if there is no ghost.
    """

    t: float
    live: bool
    poses: np.ndarray
    status: Status
    latest: np.ndarray
    window: PlotWindow
    way: np.ndarray
    ghost: GhostState | None

    @property
    def beside(self) -> PlotWindow | None:
        """The curves of the ghost; None if there is no ghost."""
        return None if self.ghost is None else self.ghost.window


def moment_of(learner: SimulationClient, past: float | None, curves: bool = True) -> Moment | None:
    """Reads new data and returns the instant that the page shows; None before the first report.

    Args:
        learner: the simulation of the page.
        past: simulated time of a past instant, s; None: now.
        curves: whether to read the telemetry and to return the recent poses of robot and ghost; otherwise
            telemetry may be old, and `way` is empty.
    """
    t = learner.look(curves)
    ghost = learner.ghost
    beside = None if ghost is None else ghost.look(curves)
    if ghost is not None and (ghost.ready is None or ghost.ready.choice != learner.choice):
        beside = None  # the ghost still shows another scene
    status = learner.status
    if t is None or status is None:
        return None
    if past is not None:
        t = past
    elif beside is not None and 0.0 < t - beside < _FAR:
        t = beside  # a ghost that is shown late would seem to track badly
    # Within `read` no other scene can be loaded: all data belong to one scene.
    shown = t
    found = learner.read(
        lambda recording: (
            recording.frame(shown),
            recording.window(shown),
            recording.latest if past is None else recording.row(shown),
            _way(recording, shown, curves),
        )
    )
    if found is None:
        return None
    frame, window, latest, way = found
    if frame is None:
        return None
    return Moment(
        t=t,
        live=past is None,
        poses=frame.poses,
        status=status if past is None else frame.status or status,
        latest=latest,
        window=window,
        way=way,
        ghost=None if ghost is None or beside is None else _ghost_state(ghost, t, curves),
    )


def _ghost_state(ghost: GhostClient, t: float, ways: bool) -> GhostState | None:
    found = ghost.read(lambda recording: (recording.frame(t), recording.window(t), _way(recording, t, ways)))
    return None if found is None or found[0] is None else GhostState(found[0].poses, found[1], found[2])


def _way(recording: Recording, t: float, wanted: bool) -> np.ndarray:
    if not wanted:
        return np.zeros((0, 0, 7))
    return np.array([frame.poses for frame in recording.frames(t - TRACE_SECONDS, t)])
