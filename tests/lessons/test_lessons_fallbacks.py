"""The cost of a tick of a session is limited, also if levels have no solution."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from himpc.references import Outlook
from himpc.tick.tables import BUDGET, budget_of
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


def test_a_cycle_at_a_small_problem_ends_early() -> None:
    """For N = 1 on a planar arm with random states, cycling ends before the budget of a large problem is
    used. It once took 44 ms, found by `benchmarks.fuzz`."""
    scene = torque_scene("planar3-singular")
    session = TorqueSession(replace(scene, settings=replace(scene.settings, horizon=1)))
    session.tick()
    kernel = getattr(session.controller, "kernel")  # noqa: B009  (other controllers have none)
    rounds = budget_of(kernel.arena) / (3 * 3 + 4.0 * kernel.arena.f["lower"].size)
    assert rounds <= 12_000
    assert budget_of(kernel.arena) < 0.1 * BUDGET


@pytest.mark.parametrize("controller", ["himpc", "nhimpc", "weighted"])
def test_a_hostile_state_costs_no_more_than_the_budget_of_a_tick(controller: str) -> None:
    """For all states, the number of changes of active rows in the kernel stays within the budget of the
    tick."""
    scene = torque_scene("iiwa14-hold")
    session = TorqueSession(
        replace(scene, settings=replace(scene.settings, horizon=20, controller=controller))
    )
    session.tick()
    kernel = getattr(session.controller, "kernel")  # noqa: B009  (other controllers have none)
    rng, spent = np.random.default_rng(0), []
    for k in range(60):
        q = session.plant.q + rng.normal(0, 10.0 ** (k % 6 - 3), 7)
        v = session.robot.v_limit * rng.normal(0, 10.0 ** (k % 4 - 2), 7)
        outlook = Outlook(session.references, session.t, 1e-3, 20)
        plan = session.controller.step(q, v, outlook, session.robot.tau_limit * rng.normal(size=7))
        assert (np.abs(plan.tau) <= session.robot.tau_limit).all()
        spent.append(BUDGET - kernel.arena.f["budget"][0])
    # A change of rows that has begun is completed; its cost is far below a tenth of the budget.
    assert max(spent) <= 1.1 * BUDGET
    assert max(spent) > 0.0
