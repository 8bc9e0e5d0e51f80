"""The compiled guard slows the joints down by the same amount as the theory, in every case that the theory
has."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
import pytest

from himpc.controllers.stall_guard import StallGuard
from himpc.limits import Limits, in_force
from himpc.limits.avoidance import Avoidance
from himpc.limits.windup import taken_back
from himpc.tick.compiled_stall_guard import CompiledStallGuard
from himpc.tick.distances import Distances
from robots import load_robot


@dataclass
class Pairs:
    """The fields of `Distances` that a guard reads."""

    carried: np.ndarray
    velocity_margin: float = 0.08
    room: float = math.inf
    moves: bool = False


def phases(
    rng: np.random.Generator, n: int
) -> list[tuple[np.ndarray, float, bool, float, np.ndarray, float]]:
    """Returns, for each of 3,000 ticks of 1 ms: the tension, the room (m), whether an object moves, the speed
    of the reference (m/s), the errors, and the speed of the joints as a share of their limits."""
    found = []
    for _ in range(12):
        tension = rng.uniform(0.0, 1.0) * rng.uniform(-1.0, 1.0, n)
        room = float(rng.choice([math.inf, 0.3, 0.05, 0.05, -0.01, -0.05]))
        moves, fastest = bool(rng.random() < 0.2), float(rng.choice([0.0, 0.0, 0.2]))
        start, rate = rng.uniform(0.0, 0.5, 2), rng.choice([0.0, 0.0, 0.3, -0.2], 2)
        for tick in range(250):
            errors = np.abs(start - 1e-3 * tick * rate)
            found.append((tension, room, moves, fastest, errors, rng.uniform(0.2, 1.0)))
    return found


@pytest.mark.parametrize("velocity", [True, False])
def test_the_compiled_guard_does_what_the_theory_says(velocity: bool) -> None:
    """Random torques, velocities and errors cover all kinds of stall. Without velocity limits, the limits
    stay infinite."""
    robot = load_robot("iiwa14")
    pairs: Distances = Pairs(Distances(robot, Avoidance(on=True)).carried)  # pyright: ignore[reportAssignmentType]
    limits = in_force(robot, Limits(velocity=velocity))
    lowest, stalls, loads, ratios = [], [], [], []
    for seed in range(6):
        rng, v = np.random.default_rng(seed), np.zeros(robot.n)
        theory, compiled = StallGuard(2, 1e-3), CompiledStallGuard(2, 1e-3)
        for tension, room, moves, fastest, errors, share in phases(rng, robot.n):
            pairs.room, pairs.moves = room, moves  # pyright: ignore[reportAttributeAccessIssue]
            v = 0.97 * v + 0.03 * share * robot.v_limit * np.sign(tension)
            tau = tension * robot.tau_limit
            expected, found = (each.limits(limits, tau, v, pairs).v_limit for each in (theory, compiled))
            assert found == pytest.approx(expected, rel=1e-12)
            lowest.append(float(np.min(expected / robot.v_limit)))
            stalls.append(theory.stall.share)
            assert theory.load is not None
            loads.append(float(theory.load.max()))
            ratios.append(float(np.max(np.abs(v) / robot.v_limit)))
            theory.errors, theory.fastest = compiled.errors, compiled.fastest = errors, fastest
    # All three reasons for a lower limit have occurred.
    assert min(stalls) < 0.1
    assert max(loads) > 0.85
    assert max(ratios) > 0.5
    assert lowest[0] == pytest.approx(0.92) if velocity else math.isinf(min(lowest))


def test_an_arm_that_loses_its_contact_gains_the_speed_that_the_guard_assumes() -> None:
    """The torque that held the contact accelerates the arm until time-delay estimation has taken it back.
    From half of `taken_back` in every joint, the arm gains half of its velocity limits, whatever its inertia
    is."""
    rng, T_s = np.random.default_rng(3), 1e-3
    root = rng.normal(size=(4, 4))
    M = root @ root.T + np.eye(4)
    M_bar = 0.3 * np.linalg.eigvalsh(M)[0] * rng.uniform(0.5, 1.0, 4)
    v_limit = rng.uniform(1.0, 3.0, 4)
    tau, v = 0.5 * taken_back(M_bar, v_limit, T_s), np.zeros(4)
    for _ in range(20_000):
        a = np.linalg.solve(M, tau)
        v, tau = v + T_s * a, tau - M_bar * a
    assert v == pytest.approx(0.5 * v_limit, rel=1e-6)
