"""A run with the eigenvalues of M⁻¹M̄, which decide whether time-delay estimation is stable."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from lessons.events import MoveTarget, Set
from lessons.experiments.jobs import JobResult, Work
from lessons.scenes.catalog import prepared, torque_scene
from lessons.session.torque import TorqueSession
from robots.arrays import Array, Mask

_SECONDS = 4.0


@final
@dataclass(frozen=True)
class EigenvalueJob(Work):
    """A run that computes the eigenvalues of M⁻¹M̄, with the plant's M, at every tick. A target that can be
    dragged jumps by up to 10 cm along each axis every half second.

    Its summary has `rms_mm`, the RMS distance of the TCP from its reference after the first second;
    `largest`, the largest eigenvalue; `beyond_2`, the largest number of consecutive ticks with an eigenvalue
    above 2.

    Attributes:
        payload_later: payload at the flange from 2 s on, kg; None: the payload does not change.
    """

    payload_later: float | None = None

    def do(self) -> JobResult:
        """Returns the run; see `Work.do`."""
        scene = prepared(torque_scene(self.spec.scene), self.spec.controller, self.spec.set)
        later = self.payload_later
        events = () if later is None else ((2.0, Set("plant.payload_kg", later)),)
        session = TorqueSession(replace(scene, events=events), self.spec.seed)
        target, rng = session.target("position"), np.random.default_rng(0)
        start = None if target is None else np.array(target.raw)
        largest: list[float] = []
        errors: list[Array] = []
        for tick in range(round(_SECONDS / session.settings.T_s)):
            if start is not None and tick % 500 == 250:
                session.post(MoveTarget("position", tuple((start + rng.uniform(-0.1, 0.1, 3)).tolist())))
            # The M of the state in which the torque of this tick acts.
            M = session.plant.mass_matrix()
            row = session.tick()
            largest.append(_largest_eigenvalue(M, session.M_bar))
            errors.append(row[session.layout.fields["error/position"]].copy())
            if session.diverged_at is not None:
                break
        t: Array = session.settings.T_s * np.arange(len(errors), dtype=float)
        distance = np.linalg.norm(errors, axis=1)[t >= 1.0]
        figures: dict[str, Any] = {
            "diverged": session.diverged_at is not None,
            "diverged_at_s": session.diverged_at,
            "rms_mm": 1e3 * float(np.sqrt((distance**2).mean())) if len(distance) else math.nan,
            "largest": max(largest),
            "beyond_2": longest(np.array(largest) > 2.0),
        }
        return JobResult(self, figures, {"t": t[:, None], "largest": np.array(largest)[:, None]})


def longest(flags: Mask) -> int:
    """Returns the length of the longest sequence of true values."""
    edges = np.flatnonzero(np.diff(np.concatenate(([False], flags, [False])).astype(int)))
    return int((edges[1::2] - edges[::2]).max(initial=0))


def _largest_eigenvalue(M: Array, M_bar: Array) -> float:
    root = np.sqrt(M_bar)
    return float(1.0 / np.linalg.eigvalsh(M / root[:, None] / root)[0])
