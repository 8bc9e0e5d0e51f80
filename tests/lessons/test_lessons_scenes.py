"""The scenes have the numbers that the project promises, those of 'Done when' 2, 3, 4 and 6."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache
from typing import Any

import numpy as np
import pytest

from lessons.events import Event, MoveTarget, Push
from lessons.recording.run import Recording, run
from lessons.recording.summary import summary
from lessons.scenes.catalog import torque_scene
from lessons.settings.assignments import with_assignments


def record(
    name: str,
    *assignments: str,
    duration: float,
    urdf: str | None = None,
    seed: int = 0,
    events: tuple[tuple[float, Event], ...] = (),
) -> Recording:
    scene = torque_scene(name, urdf)
    settings = with_assignments(scene.settings, assignments)
    return run(replace(scene, settings=settings, events=events), duration, seed)


def assert_sound(result: dict[str, Any]) -> None:
    """Asserts that a run is sound as defined for the command line: finite, every QP solved, no fallback."""
    assert result["diverged"] is False
    assert result["finite"] is True
    assert result["solver"]["unsolved"] == 0
    assert result["solver"]["fallbacks"] == {}
    assert result["solver"]["max_kkt_residual"] <= 1e-6
    assert result["priority_leak_max"] is None or result["priority_leak_max"] <= 1e-6
    assert result["limits"]["torque"]["max_ratio"] <= 1.000
    assert (result["limits"]["position"]["max_ratio"] or 0.0) <= 1.000


@pytest.fixture(scope="module")
def circle() -> dict[str, Any]:
    return summary(record("iiwa14-circle", duration=4.0))


def test_the_circle_is_sound(circle: dict[str, Any]) -> None:
    """For 4 s from rest, RT4 keeps the promised bounds, residuals and leak, without a fallback."""
    assert_sound(circle)
    assert circle["limits"]["velocity"]["max_ratio"] <= 1.10
    assert circle["duration_s"] == pytest.approx(4.0)
    assert circle["solver"]["solves"] == 3 * 4000


def test_the_circle_is_accurate(circle: dict[str, Any]) -> None:
    """After the first second the RMSE of level 1 is within 1.5 mm per axis, and that of level 2 within 1°."""
    position, orientation, q1 = circle["tasks"]
    assert (position["name"], position["level"], position["unit"]) == ("position", 1, "m")
    assert (orientation["name"], orientation["level"], orientation["unit"]) == ("orientation", 2, "deg")
    assert q1["level"] == 3
    assert max(position["rmse_after_1s"]) <= 1.5e-3
    assert max(orientation["rmse_after_1s"]) <= 1.0


def test_the_circle_presses_on_its_bounds(circle: dict[str, Any]) -> None:
    """Level 3 demands more than joint 1 can do; therefore bounds are active in the scene, and they are
    counted."""
    assert circle["bound_active_share"] > 0.1
    assert circle["limits"]["velocity"]["max_ratio"] > 0.95
    assert circle["dynamic_leak_max"] > circle["priority_leak_max"]


def test_same_seed_same_output() -> None:
    """Two runs with the same seed have equal results, except for the computing times."""
    results = []
    for _ in range(2):
        result = summary(record("iiwa14-circle", duration=0.4, seed=3))
        for key in ("step_ms", "real_time_factor"):
            del result[key]
        results.append(result)
    assert results[0] == results[1]


VARIANTS = ("horizon=10", "plant.payload_kg=2", "plant.inertia_scale=0.8")


@lru_cache(maxsize=len(VARIANTS))
def circle_with(assignment: str) -> dict[str, Any]:
    return summary(record("iiwa14-circle", assignment, duration=4.0))


@pytest.mark.parametrize("assignment", VARIANTS)
def test_the_circle_stays_sound_when(assignment: str) -> None:
    """The circle stays sound with a longer horizon, an unknown payload, and lighter links."""
    assert_sound(circle_with(assignment))


PAYLOAD = pytest.mark.xfail(
    strict=True,
    reason="2 kg at the flange make joint 6 some 35 times heavier than the paper's M̄ says, and time-delay "
    "estimation lags: joint 6 at 2.80 times its speed limit, level 1 off by 31, 82, 12 mm RMSE",
)


@pytest.mark.parametrize("assignment", [VARIANTS[0], pytest.param(VARIANTS[1], marks=PAYLOAD), VARIANTS[2]])
def test_the_circle_stays_fast_and_accurate_when(assignment: str) -> None:
    """With the same changes, the speeds and the accuracy of level 1 stay within the limits of the nominal
    run."""
    result = circle_with(assignment)
    assert result["limits"]["velocity"]["max_ratio"] <= 1.10
    assert max(result["tasks"][0]["rmse_after_1s"]) <= 1.5e-3


@pytest.mark.parametrize("name", ["panda-hold", "planar3-hold", "iiwa14-hold"])
def test_hold_scenes_are_sound(name: str) -> None:
    """A robot that is at rest on its targets stays there."""
    result = summary(record(name, duration=4.0))
    assert_sound(result)
    assert result["limits"]["velocity"]["max_ratio"] <= 0.05
    assert max(result["tasks"][0]["max_abs"]) <= 1e-3


@pytest.mark.parametrize(
    "file",
    [
        "xarm_description/urdf/xarm7.urdf",
        pytest.param("ur_description/urdf/ur10_robot.urdf", marks=pytest.mark.nightly("robots/", "himpc/")),
    ],
)
def test_hold_is_sound_on_robots_of_others(example_urdf: Callable[[str], str], file: str) -> None:
    """`run hold --urdf` is sound for a UR10 and an xArm 7 of example-robot-data."""
    result = summary(record("hold", duration=4.0, urdf=example_urdf(file)))
    assert_sound(result)
    assert result["limits"]["velocity"]["max_ratio"] <= 0.05
    assert max(result["tasks"][0]["max_abs"]) <= 1e-3


def test_printed_position_rows_fail_honestly() -> None:
    """With (32d) as printed and twice the speed, QPs fail. The run still ends, its numbers are finite, and
    every fallback is counted."""
    recording = record("iiwa14-circle", "limits.position=paper", "limits.velocity_scale=2", duration=4.0)
    result = summary(recording)
    solver = result["solver"]
    assert solver["unsolved"] > 0
    assert sum(solver["fallbacks"].values()) == solver["unsolved"]
    assert set(solver["fallbacks"]) <= {"soften", "feasible", "previous", "inherit", "brake", "hold"}
    assert solver["max_kkt_residual"] <= 1e-6
    assert result["finite"] is True
    assert result["limits"]["torque"]["max_ratio"] <= 1.000


@pytest.mark.parametrize(
    "assignments",
    [
        pytest.param(
            ("plant.encoder_resolution_deg=0.00125",),
            marks=pytest.mark.nightly("himpc/", "lessons/session", "robots/plant.py"),
        ),
        ("plant.encoder_resolution_deg=0.00125", "plant.friction=0.5"),
    ],
    ids=["encoder", "encoder and friction"],
)
def test_sensor_resolution_and_friction_cause_no_limit_cycle(assignments: tuple[str, ...]) -> None:
    """In 8 s of iiwa14-hold with a move and a push, the tip moves less than 0.2 mm peak to peak after it has
    settled."""
    events = (
        (0.2, MoveTarget("position", (0.506, 0.05, 0.428))),
        (2.0, Push("joint_4", force=(0.0, 20.0, 0.0))),
    )
    recording = record("iiwa14-hold", *assignments, duration=8.0, events=events)
    x = recording["x/position"]
    assert not recording.session.notices
    assert np.ptp(x[:3000], axis=0).max() > 0.02
    assert np.ptp(x[5000:], axis=0).max() <= 0.2e-3
    assert summary(recording)["diverged"] is False
