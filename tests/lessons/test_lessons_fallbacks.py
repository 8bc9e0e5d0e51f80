"""What a hard tick of a session costs at most."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from himpc.references import Outlook
from himpc.tick import fallbacks
from himpc.tick.tables import BUDGET, budget_of
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession


def test_a_cycle_at_a_small_problem_ends_early() -> None:
    """At N = 1 a planar arm thrown about does not go round and round until a large problem's budget is spent
    (44 ms once; seen in `benchmarks.fuzz`)."""
    scene = torque_scene("planar3-singular")
    session = TorqueSession(replace(scene, settings=replace(scene.settings, horizon=1)))
    session.tick()
    kernel = getattr(session.controller, "kernel")  # noqa: B009  (other controllers have none)
    rounds = budget_of(kernel.arena) / (3 * 3 + 4.0 * kernel.arena.f["lower"].size)
    assert rounds <= 12_000
    assert budget_of(kernel.arena) < 0.1 * BUDGET


@pytest.mark.parametrize("controller", ["himpc", "nhimpc", "weighted"])
def test_a_hostile_state_costs_no_more_than_the_budget_of_a_tick(controller: str) -> None:
    """Whatever the state, the kernel's changes of active rows stay within the tick's multiplications."""
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
    # What is begun is ended: one change of rows is far less than a tenth.
    assert max(spent) <= 1.1 * BUDGET
    assert max(spent) > 0.0


def test_nhimpc_asks_the_printed_route_a_few_times_a_tick(monkeypatch: pytest.MonkeyPatch) -> None:
    """Ten iterations of three levels that the kernel gives up could ask thirty times, a millisecond or more
    each (seen in `benchmarks.fuzz`: 24 times, 33 ms)."""
    asked: list[str] = []

    def counted(*given: Any) -> Any:
        asked.append("printed")
        return solves(*given)

    solves = fallbacks.solve_explicit
    monkeypatch.setattr(fallbacks, "solve_explicit", counted)
    monkeypatch.setattr(fallbacks, "solve_level", lambda *_: False)
    scene = torque_scene("iiwa14-circle-paper")
    session = TorqueSession(replace(scene, settings=replace(scene.settings, horizon=3, controller="nhimpc")))
    rng, most = np.random.default_rng(0), 0
    for _ in range(10):
        asked.clear()
        q = session.plant.q + 0.1 * rng.normal(size=7)
        v = 2.0 * session.robot.v_limit * rng.normal(size=7)
        outlook = Outlook(session.references, session.t, 1e-3, 3)
        session.controller.step(q, v, outlook, session.plant.tau)
        most = max(most, len(asked))
    assert 0 < most <= 3
