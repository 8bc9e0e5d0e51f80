"""Control-step times of HIMPC, compiled and as printed with each solver, taken side by side in one run."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from himpc.qp import Solver, is_installed
from lessons.events import MoveTarget
from lessons.scenes.catalog import as_torque_scene
from lessons.scenes.run_spec import AS_PRINTED, RunSpec
from lessons.session.torque import TorqueSession

HORIZONS = (5, 10, 20, 30)
SCENES = ("iiwa14-circle", "iiwa14-hold")
"""A scene whose motion is known beforehand, and scenes with dragged targets."""
CONTENDERS: tuple[tuple[str, Solver], ...] = (
    ("himpc", "daqp"),
    ("himpc_printed", "daqp"),
    ("himpc_printed", "proxqp"),
    ("himpc_printed", "qpoases"),
)
"""The last contender takes part only if CasADi is installed."""
_LONGEST_PRINTED = 20
"""Longest horizon for which himpc_printed takes part; a longer one takes seconds per step."""
_TURN = 10
"""Number of timed ticks of a contender before the next contender runs. The contenders take turns, and the
noise of the machine affects all of them equally. An untimed tick precedes each turn: at that tick the caches
still hold the data of the previous contender, which does not happen on a robot.
"""
_DRAG_TICKS = 100
"""Ticks from one drag to the next."""
_BUDGET_S = 6.0
"""Wall time, s, after which a contender stops early; the number of its ticks is reported."""


@dataclass(frozen=True)
class Timing:
    """Times of one contender, ms: the whole step (state in, torque out) and the QP solver's share."""

    horizon: int
    controller: str
    solver: str
    ticks: int
    step_ms: dict[str, float]
    qp_ms: float


def bench(
    scene: str = "iiwa14-circle",
    horizons: Sequence[int] = HORIZONS,
    ticks: int = 300,
    progress: Callable[[float], None] | None = None,
) -> list[Timing]:
    """Runs every contender on its own copy of a scene, in turns.

    Args:
        scene: the scene.
        horizons: horizons N.
        ticks: timed ticks per contender.
        progress: called with the completed share.
    """
    loaded = as_torque_scene(RunSpec(scene).but(*AS_PRINTED).prepared(), "bench's")
    timings = []
    for index, N in enumerate(horizons):
        sessions = {}
        contenders = CONTENDERS if N <= _LONGEST_PRINTED else CONTENDERS[:1]
        for controller, solver in (contender for contender in contenders if is_installed(contender[1])):
            settings = replace(loaded.settings, horizon=N, controller=controller, solver=solver)
            sessions[controller, solver] = TorqueSession(replace(loaded, settings=settings))
        steps: dict[tuple[str, str], list[float]] = {key: [] for key in sessions}
        solves: dict[tuple[str, str], list[float]] = {key: [] for key in sessions}
        for turn in range(-(-ticks // _TURN)):
            for key, session in sessions.items():
                for tick in range(1 + _TURN if sum(steps[key]) < 1e3 * _BUDGET_S else 0):
                    _drag(session, turn * (1 + _TURN) + tick)
                    session.tick()
                    if tick > 0 and session.plan is not None:
                        steps[key].append(session.plan.step_us / 1e3)
                        # The kernel uses no external solver. The collection of its evidence is not part of a
                        # step.
                        levels = () if key[0] == "himpc" else session.plan.levels
                        solves[key].append(sum(level.qp_us for level in levels) / 1e3)
        timings += [
            Timing(N, name, solver, len(times), _spread(times), float(np.median(solves[name, solver])))
            for (name, solver), times in steps.items()
        ]
        if progress is not None:
            progress((index + 1) / len(horizons))
    return timings


def _drag(session: TorqueSession, tick: int) -> None:
    """Moves the draggable target, if there is one, at regular intervals."""
    target = session.target("position")
    if target is not None and tick % _DRAG_TICKS == _TURN:
        away = 0.2 * np.cos(np.arange(3) + tick)
        session.post(MoveTarget("position", tuple(target.value + away)))


def _spread(times: list[float]) -> dict[str, float]:
    return {
        "median": float(np.median(times)),
        "p95": float(np.percentile(times, 95)),
        "p99": float(np.percentile(times, 99)),
    }


def ratios(timings: Sequence[Timing]) -> dict[str, Any]:
    """Returns, for each horizon, the ratio of the step time of himpc_printed to that of himpc, and the ratio
    of ProxQP's QP time to DAQP's."""
    by_case = {(t.horizon, t.controller, t.solver): t for t in timings}
    result = {}
    for N in sorted({t.horizon for t in timings}):
        compiled = by_case[N, "himpc", "daqp"].step_ms["median"]
        if (N, "himpc_printed", "daqp") not in by_case:
            continue
        daqp, proxqp = by_case[N, "himpc_printed", "daqp"], by_case[N, "himpc_printed", "proxqp"]
        result[str(N)] = {
            "printed_daqp_over_compiled": daqp.step_ms["median"] / compiled,
            "printed_proxqp_over_compiled": proxqp.step_ms["median"] / compiled,
            "proxqp_qp_over_daqp_qp": proxqp.qp_ms / daqp.qp_ms if daqp.qp_ms else None,
        }
        qpoases = by_case.get((N, "himpc_printed", "qpoases"))
        if qpoases is not None and daqp.qp_ms:
            result[str(N)]["qpoases_qp_over_daqp_qp"] = qpoases.qp_ms / daqp.qp_ms
    return result
