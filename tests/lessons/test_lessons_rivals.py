"""OSF, TDEOSF and HQP run in the scenes, also near a singularity."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc.controllers import make_controller
from himpc.plan import Plan
from himpc.references import Hold
from lessons.scenes.catalog import torque_scene
from robots import load_robot

Array = NDArray[np.float64]


def straight(name: str, **changes: Any) -> Plan:
    """Returns the plan of one tick for the straight planar arm, with a target that pulls its tip towards the
    base."""
    loaded = torque_scene("planar3-singular")
    chosen = replace(loaded.settings.for_controller(), **changes)
    pulled = {
        "position": Hold(np.array([0.85, 0.0])).preview(0.0, 1e-3, 5),
        "q1": Hold(np.array([0.3])).preview(0.0, 1e-3, 5),
    }
    q = np.array([0.0, 1e-7, 0.0])
    return make_controller(name, loaded.robot, chosen).step(q, np.zeros(3), pulled)


@pytest.mark.parametrize("name", ["osf", "tdeosf"])
def test_near_a_singularity_nothing_is_hidden(name: str) -> None:
    """The undamped laws demand finite torques of thousands of times the limit; those of the damped laws are
    below the limit."""
    limit = load_robot("planar3").tau_limit
    assert np.abs(straight(name).tau / limit).max() > 1e3
    damped = straight(f"{name}_damped").tau
    assert 0.0 < np.abs(damped / limit).max() < 1.0


def test_a_direction_that_is_gone_is_named() -> None:
    """If the arm is exactly straight, OSF omits the lost direction, and the status of the level names it."""
    loaded = torque_scene("planar3-singular")
    controller = make_controller("osf", loaded.robot, loaded.settings.for_controller())
    references = loaded.references(loaded.robot, loaded.settings.levels)
    previews = {name: each.preview(0.0, 1e-3, 5) for name, each in references.items()}
    plan = controller.step(np.zeros(3), np.zeros(3), previews)
    assert plan.levels[0].status == "directions lost: 1"
    assert np.abs(plan.tau).max() < 4.0


def test_hqp_passes_the_singularity_inside_its_bounds() -> None:
    """R > 0 keeps the Hessian positive definite, so that every level is solved and the torque bounds hold."""
    for R in (10.0, 1e-6):
        levels = tuple(replace(level, R=R) for level in torque_scene("planar3-singular").settings.levels)
        plan = straight("hqp", stack=levels)
        assert plan.unsolved == 0 and plan.kkt_residual <= 1e-6
        assert np.abs(plan.tau).max() <= 4.0
