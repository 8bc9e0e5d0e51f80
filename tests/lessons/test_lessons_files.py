"""Recorded files have a row per tick and settings that reproduce the run; every scene of the list loads."""

from __future__ import annotations

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from lessons.events import MoveTarget, Set, from_data
from lessons.recording.arrays import arrays
from lessons.recording.run import run
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession
from lessons.settings.assignments import with_assignments
from robots import InputError


@pytest.fixture(scope="module")
def recorded(scene: TorqueScene) -> dict[str, Any]:
    settings = with_assignments(scene.settings, ["horizon=3", "plant.payload_kg=1"])
    events = ((0.02, MoveTarget("position", (0.5, 0.1, 0.6))), (0.05, Set("levels.posture.enabled", False)))
    recording = run(replace(scene, settings=settings, events=events), duration=0.2, seed=5)
    return arrays(recording, {"scene": "iiwa14-hold", "seed": 5, "set": ["horizon=3", "plant.payload_kg=1"]})


def test_npz_holds_a_row_per_tick(recorded: dict[str, Any]) -> None:
    """The file contains times, joints, references and errors of every task, with their names."""
    assert recorded["t"].shape == (200,)
    np.testing.assert_allclose(np.diff(recorded["t"]), 1e-3)
    for name in ("q", "v", "tau", "tau_demand", "tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper"):
        assert recorded[name].shape == (200, 7)
        assert np.isfinite(recorded[name]).all()
    assert recorded["x_d/orientation"].shape == (200, 4)
    assert recorded["error/position"].shape == (200, 3)
    assert int(recorded["level/orientation"]) == 2
    assert len(recorded["joint_names"]) == 7
    np.testing.assert_allclose(
        recorded["error/position"], recorded["x/position"] - recorded["x_d/position"], atol=1e-12
    )


def test_the_settings_beside_it_reproduce_the_run(recorded: dict[str, Any]) -> None:
    """A run with the same scene, settings, seed and timestamped events gives bitwise the same torques."""
    how = json.loads(str(recorded["settings"]))
    assert [event["event"] for event in how["events"]] == ["MoveTarget", "Set"]
    assert how["in_force"]["horizon"] == 3
    scene = torque_scene(how["scene"])
    events = tuple((event.pop("t"), from_data(event)) for event in how["events"])
    settings = with_assignments(scene.settings, how["set"])
    again = arrays(run(replace(scene, settings=settings, events=events), duration=0.2, seed=how["seed"]), {})
    for name in ("t", "q", "tau", "x_d/position", "error/orientation"):
        np.testing.assert_array_equal(again[name], recorded[name])


def test_every_scene_loads_and_ticks() -> None:
    """All scenes of the list load; 'hold' accepts any robot, also by its name in the catalog."""
    for name in SCENES:
        session = TorqueSession(torque_scene(name, "planar3" if name == "hold" else None))
        session.tick()
        assert session.plan is not None
        assert np.isfinite(session.plan.tau).all()


@pytest.mark.parametrize(
    ("name", "urdf", "tip"),
    [
        ("iiwa14-hodl", None, None),
        ("hold", None, None),
        ("iiwa14-hold", "planar3", None),
        ("iiwa14-circle", None, "flange"),
        ("hold", "planar4", None),
        ("hold", "planar3", "nose"),
        ("hold", "/nowhere/arm.urdf", None),
    ],
)
def test_scenes_that_cannot_be(name: str, urdf: str | None, tip: str | None) -> None:
    with pytest.raises(InputError) as error:
        torque_scene(name, urdf, tip)
    assert "\n" not in str(error.value)


def test_a_run_needs_a_length(scene: TorqueScene) -> None:
    for seconds in (0.0, -1.0, float("nan"), 1e9):
        with pytest.raises(InputError, match="duration"):
            run(scene, seconds)
