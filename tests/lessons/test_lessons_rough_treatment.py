"""After jumps and pushes the robot stays within its bounds and comes to rest, and replays are bitwise
equal."""

from __future__ import annotations

from dataclasses import replace
from functools import lru_cache
from itertools import combinations

import numpy as np
import pytest
from numpy.typing import NDArray
from session_rows import field, rows_of

from lessons.events import Event, MoveLevel, MoveTarget, Push, Set
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]


JUMPS = {
    "iiwa forward": ("iiwa14-hold", (1.0, 0.0, 0.0)),
    "iiwa up": ("iiwa14-hold", (0.0, 0.0, 1.0)),
    "iiwa down": ("iiwa14-hold", (0.0, 0.0, -1.0)),
    "planar back": ("planar3-hold", (-1.0, 0.0)),
    "planar side": ("planar3-hold", (0.0, 1.0)),
}


@lru_cache(maxsize=len(JUMPS))
def after_jump(case: str) -> tuple[TorqueSession, Array]:
    """Returns the session and the rows of 2.5 s after a sudden jump of the target by 1 m, reachable or not.
    The arm has no contact, because an impact changes velocities independently of the controller."""
    name, jump = JUMPS[case]
    scene = torque_scene(name)
    plant = replace(scene.settings.plant, contacts=False, joint_stops=False)
    session = TorqueSession(replace(scene, settings=replace(scene.settings, plant=plant)))
    session.tick()
    target = session.target("position")
    assert target is not None
    session.post(MoveTarget("position", tuple(target.value + np.array(jump))))
    return session, rows_of(session, 2500)


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_the_torque_in_its_bounds(case: str) -> None:
    """After a jump of the gizmo by 1 m all numbers stay finite, and no demanded torque exceeds its bound."""
    session, rows = after_jump(case)
    assert np.isfinite(field(session, rows, "q")).all()
    assert np.isfinite(field(session, rows, "tau")).all()
    assert (np.abs(field(session, rows, "tau_demand")) <= field(session, rows, "tau_upper")).all()
    assert np.nanmax(field(session, rows, "priority_leak")) <= 1e-6


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_velocities_in_their_bounds(case: str) -> None:
    """No joint exceeds 1.10 times its velocity limit."""
    session, rows = after_jump(case)
    assert (np.abs(field(session, rows, "v")) / field(session, rows, "v_limit")).max() <= 1.10


@pytest.mark.parametrize("case", JUMPS)
def test_a_jump_of_the_gizmo_keeps_positions_in_their_bounds(case: str) -> None:
    """No joint exceeds its position limit."""
    session, rows = after_jump(case)
    q, lower, upper = (field(session, rows, name) for name in ("q", "q_lower", "q_upper"))
    bounded = np.isfinite(upper - lower)
    share = np.abs(q - (lower + upper) / 2)[bounded] / ((upper - lower) / 2)[bounded]
    assert share.max(initial=0.0) <= 1.0


SUBSETS = [names for size in range(4) for names in combinations(("position", "orientation", "posture"), size)]


@pytest.mark.parametrize("enabled", SUBSETS, ids=lambda names: "+".join(names) or "none")
def test_a_push_dies_out_under_every_subset_of_levels(enabled: tuple[str, ...], scene: TorqueScene) -> None:
    """After 5 N·m for 0.1 s on a middle link, all joints are slow 3 s later, for every subset of enabled
    levels."""
    session = TorqueSession(scene)
    for name in ("position", "orientation", "posture"):
        session.post(Set(f"levels.{name}.enabled", name in enabled))
    rows_of(session, 20)
    body = session.robot.joint_names[3]
    session.post(Push(body, torque=(2.0, 3.0, 3.4641), seconds=0.1))
    rows = rows_of(session, 3100)
    assert np.abs(field(session, rows, "v")[:120]).max() > 0.02
    assert np.abs(field(session, rows, "v")[-1]).max() < 0.05
    assert session.diverged_at is None


def test_same_events_same_numbers_to_the_bit(scene: TorqueScene) -> None:
    """Two sessions that receive the same events produce the same rows, except for the computing times."""
    script: dict[int, Event] = {
        3: MoveTarget("position", (0.5, 0.2, 0.6)),
        40: Set("levels.orientation.enabled", False),
        60: Set("horizon", 9),
        90: Push(scene.robot.joint_names[2], force=(0.0, 20.0, 0.0)),
        120: MoveLevel("posture", 0),
        150: Set("limits.velocity_scale", 0.2),
    }
    results = []
    for _ in range(2):
        session = TorqueSession(scene, seed=4)
        rows = []
        for k in range(250):
            if k in script:
                session.post(script[k])
            rows.append(session.tick().copy())
        timing = [f for f in session.layout.fields if f.split("/")[0] in ("step_us", "time_us", "qp_us")]
        assert len(timing) >= 4
        array = np.array(rows)
        for name in timing:
            array[:, session.layout.fields[name]] = 0.0
        assert len(session.log) == len(script)
        results.append(array.tobytes())
    assert results[0] == results[1]
