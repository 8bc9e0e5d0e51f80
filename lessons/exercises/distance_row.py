"""The distance row

An arm must not touch a table and a post: which bound on its torque guarantees this?

Minutes: 30
You need: exercise "two-levels"; lesson "keeping-clear"
"""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from typing import Any

import numpy as np

from himpc.controllers.view import View
from lessons.events import MoveTarget
from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import Array
from lessons.exercises.mistakes import Mistake, wrong
from lessons.exercises.starts.distance_row import cascade
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import card_of
from lessons.teaching.measure import Measure, Signal

SETTINGS = (
    *("avoidance.on=true", "avoidance.pull=0", "avoidance.velocity_margin=0"),
    "levels.orientation.enabled=false",
    *("horizon=1", "damping=false", "T_s=0.002"),
)
NEAREST = Signal("distance", "mm")
DOWN = MoveTarget("position", (0.556, 0.0, 0.19))
UP = MoveTarget("position", (0.6, 0.0, 0.26))
PAST_THE_POST = MoveTarget("position", (0.4, -0.4, 0.4))
BACK = MoveTarget("position", (0.5, 0.0, 0.5))
_run = partial(RunSpec, "iiwa14-table", set=SETTINGS)
INTO = _run(events=((0.0, DOWN), (0.9, UP)), duration=1.4)
PAST = _run(events=((0.0, PAST_THE_POST), (0.45, BACK)), duration=0.7)
# `now.near.d_safe` contains the margin. The nearest pair begins within the margin, where d must not decrease.
WITHIN = replace(PAST, set=(*SETTINGS, "avoidance.d_safe=0.08", "avoidance.margin=0.03"), duration=0.1)


def checks(seed: int) -> tuple[GradeCheck, ...]:
    return (
        GradeCheck(
            "If the target of the hand lies in the table, the arm still touches nothing.",
            "the row does not bound how fast d shrinks, or bounds it too late",
            INTO,
            5.0,
            "at least",
            measure=Measure(NEAREST, "smallest"),
            points=3,
        ),
        GradeCheck(
            "The hand comes as near to the table as the row allows.",
            "far from d_safe the bound must be looser, and at d_safe it must be 0",
            INTO,
            25.0,
            measure=Measure(NEAREST, "last", until=0.9),
            points=1,
        ),
        GradeCheck(
            "Then the hand reaches a target in free space, 6 cm above the table.",
            "the bound is tighter than the stopping distance requires, or the arm goes out of control",
            INTO,
            15.0,
            measure=Measure(Signal("error/position", "mm"), "last"),
            points=2,
        ),
        GradeCheck(
            "On a path past the post, with a push, the torque is the optimum of both levels.",
            "D = T_s ∇dᵀM̄⁻¹ or its lower bound is wrong: v_stop, ∇dᵀq̇, ∇dᵀq̈₀ or `approach`",
            pushed(PAST, seed, "link_5", 20.0),
            1e-6,
            beside="hiqp",
            points=3,
        ),
        GradeCheck(
            "If a pair begins below d_safe, the torque is the optimum, too.",
            "the bound below d_safe is wrong: there v_stop is that of the distance 0",
            with_gains(WITHIN, seed + 1, "position", "posture", K_p=60.0),
            1e-6,
            beside="hiqp",
            points=1,
        ),
    )


def _rows(
    now: View,
    *,
    D: float = 1.0,
    gradient: float = 1.0,
    M_bar: bool = True,
    T_s: bool = True,
    d_safe: float = 1.0,
    v_stop: str = "viable",
    speed: float = 1.0,
    q_ddot: float = 1.0,
    at_once: bool = False,
    pairs: str = "all",
) -> tuple[Array, Array]:
    """Returns D and the lower bounds. The arguments are factors on terms, or switch terms off."""
    near, T = now.near, now.T_s
    slopes = gradient * near.gradient
    free = near.d - d_safe * near.d_safe
    room = np.maximum(free, 0.0)
    t, a = near.reaction, near.deceleration
    stop = {
        "viable": a * (np.sqrt(t**2 + 2.0 * room / a) - t),
        "no reaction": np.sqrt(2.0 * a * room),
        "upwards": -a * (np.sqrt(t**2 + 2.0 * room / a) - t),
        "none": 0.0 * room,
        "linear": room / t,
        "signed": a * (np.sqrt(np.maximum(t**2 + 2.0 * free / a, 0.0)) - t),
    }[v_stop]
    share = 1.0 if at_once else min(1.0, now.bounds.approach * T or 1.0)
    lower = share * (-stop - speed * slopes @ now.q_dot) - q_ddot * T * slopes @ now.q_ddot
    rows = D * (T if T_s else 1.0) * (slopes / now.M_bar if M_bar else slopes)
    chosen = {
        "all": slice(None),
        "nearest": slice(1),
        "touching": near.d <= near.d_safe,
        "none": slice(0),
    }[pairs]
    return rows[chosen], lower[chosen]


def _law(now: View, **how: Any) -> Any:
    return cascade(now, *_rows(now, **how))


MISTAKES: tuple[Mistake, ...] = (
    wrong("no pair has a row", _law, pairs="none"),
    wrong("∇d has the wrong sign: the row must bound how d shrinks, not how it grows", _law, gradient=-1.0),
    wrong("∇d has the wrong sign in D", _law, D=-1.0),
    wrong("M̄ is missing in D = T_s ∇dᵀM̄⁻¹", _law, M_bar=False),
    wrong("T_s is missing in D = T_s ∇dᵀM̄⁻¹", _law, T_s=False),
    wrong("d_safe is missing: the distance for stopping is d − d_safe", _law, d_safe=0.0),
    wrong("v_stop has the wrong sign: a bound of −v_stop lets d shrink to d_safe", _law, v_stop="upwards"),
    wrong("the bound is constant: d can never shrink, not even far from d_safe", _law, v_stop="none"),
    wrong("the bound is linear in d − d_safe: v_stop contains a square root", _law, v_stop="linear"),
    wrong("d − d_safe is negative below d_safe: s = max(d − d_safe, 0)", _law, v_stop="signed"),
    wrong("the reaction time t is missing in v_stop", _law, v_stop="no reaction"),
    wrong("∇dᵀq̇ is missing: Δτ changes the present velocity", _law, speed=0.0),
    wrong("q̈₀ is missing: with Δτ = 0 the robot continues to accelerate", _law, q_ddot=0.0),
    wrong("one period uses the whole distance to the bound: `approach` is not used", _law, at_once=True),
    wrong("only the nearest pair has a row", _law, pairs="nearest"),
    wrong("a pair has a row only at d_safe or below: there it is too late to stop", _law, pairs="touching"),
)


EXERCISE = Exercise(
    name="distance-row",
    card=card_of(__doc__),
    equation=r"\nabla d^\top (\dot q + T_s (\ddot q_0 + \bar M^{-1} \Delta\tau)) \ge "
    r"-v_\mathrm{stop}(d - d_\mathrm{safe})",
    plain="∇dᵀ(q̇ + T_s (q̈₀ + M̄⁻¹Δτ)) ≥ −v_stop(d − d_safe), v_stop(s) = a (√(t² + 2s/a) − t)",
    hints=(
        "`now.near.gradient @ now.q_dot` is the rate at which each distance grows. The next velocity is "
        "q̇ + T_s (q̈₀ + M̄⁻¹Δτ).",
        "The factor of Δτ is D = T_s ∇dᵀM̄⁻¹, a row for each pair. All other terms go to the right-hand side.",
        "The largest speed from which the arm can still stop within the distance s is "
        "v_stop(s) = a (√(t² + 2s/a) − t); here s = max(d − d_safe, 0).",
        "As for a bound of a joint, one period uses at most the share min(1, approach · T_s) of the distance "
        "to the bound: share · (−v_stop − ∇dᵀq̇) is the least change of ∇dᵀq̇.",
    ),
    lesson="keeping-clear",
    checks=checks,
    mistakes=MISTAKES,
    live=("avoidance.on=true",),
)
