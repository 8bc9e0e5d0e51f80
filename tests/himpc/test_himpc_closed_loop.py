"""In closed loop with the plant, controllers hold and follow targets, and use only the model that their
documentation names."""

from __future__ import annotations

import numpy as np
import pytest
from closed_loop import holding
from numpy.typing import NDArray

from himpc.catalog import CONTROLLERS
from himpc.references import Target
from robots import NominalSettings

Array = NDArray[np.float64]

MODEL_BASED = ("osf", "osf_damped", "hqp")
HEAVY = NominalSettings(payload_kg=3.0, damping=0.4, armature=0.2, inertia_scale=1.3, gravity=False)


@pytest.mark.parametrize("name", ["iiwa14", "planar3"])
@pytest.mark.parametrize("horizon", [1, 2, 20])
def test_any_horizon_holds_and_follows(name: str, horizon: int) -> None:
    """With N = 1 (HIQP) and with long horizons, the arm holds its targets and follows a moved target."""
    loop = holding(name, "himpc", horizon)
    loop.tick()
    target = loop.references["position"]
    assert isinstance(target, Target)
    goal = target.value
    goal[0] -= 0.05
    target.move(goal)
    plans = [loop.tick() for _ in range(1500)]
    assert np.abs(plans[-1].errors["position"]).max() < 2e-3
    _, at = loop.plant.frame_pose(loop.plant.robot.tip)
    assert np.linalg.norm(at[: goal.size] - goal) < 4e-3
    assert sum(plan.unsolved for plan in plans) == 0


@pytest.mark.parametrize("robot", ["planar3", "iiwa14", "panda"])
@pytest.mark.parametrize("name", CONTROLLERS)
def test_every_controller_holds_every_catalog_robot(name: str, robot: str) -> None:
    loop = holding(robot, name)
    for _ in range(200):
        plan = loop.tick()
        assert np.abs(plan.errors["position"]).max() < 1e-4
    assert not loop.plant.broken


def torques(name: str, nominal: NominalSettings | None = None) -> Array:
    """Returns the torques of a planar arm whose hand is dragged, (60, 3) N·m."""
    loop = holding("planar3", name, nominal=nominal)
    target = loop.references["position"]
    assert isinstance(target, Target)
    target.move(target.value + np.array([-0.1, 0.05]))
    return np.array([loop.tick().tau for _ in range(60)])


@pytest.mark.parametrize("name", [name for name in CONTROLLERS if name not in MODEL_BASED])
def test_model_free_controllers_never_read_the_nominal_model(name: str) -> None:
    """The torques are bitwise equal for all nominal models."""
    np.testing.assert_array_equal(torques(name), torques(name, HEAVY))


@pytest.mark.parametrize("name", MODEL_BASED)
def test_model_based_controllers_do_read_it(name: str) -> None:
    assert np.abs(torques(name) - torques(name, HEAVY)).max() > 1e-3


@pytest.mark.parametrize("name", CONTROLLERS)
def test_same_start_same_torques(name: str) -> None:
    np.testing.assert_array_equal(torques(name), torques(name))
