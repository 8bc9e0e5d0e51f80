"""The controller is switched while the robot moves: the torque has no jump, and control continues."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from himpc import CONTROLLERS
from himpc.controllers.distance_filter import DistanceFilter
from himpc.references.outlook import observed_by
from lessons.events import MoveTarget, Reset, Set
from lessons.scenes.catalog import torque_scene
from lessons.scenes.scene import TorqueScene
from lessons.session.bumpless import HANDOVER_SECONDS, Handover
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]

SCENE = torque_scene("iiwa14-hold")
TICKS = round(HANDOVER_SECONDS / SCENE.settings.T_s)


def tip(session: TorqueSession) -> Array:
    return session.plant.frame_pose(session.robot.tip)[1].copy()


def at_rest(controller: str, scene: TorqueScene = SCENE) -> TorqueSession:
    session = TorqueSession(scene)
    session.post(Set("controller", controller))
    for _ in range(TICKS + 50):
        session.tick()
    return session


def switch(session: TorqueSession, name: str, start: Array) -> None:
    """Switches the controller; no tick changes a torque by 5 % of its limit, or moves the tip by 1 mm from
    `start`."""
    session.post(Set("controller", name))
    before = session.plant.tau
    for _ in range(TICKS + 20):
        session.tick()
        now = session.plant.tau
        assert np.abs((now - before) / session.robot.tau_limit).max() < 0.05
        assert np.linalg.norm(tip(session) - start) < 1e-3
        before = now
    assert session.settings.controller == name
    assert not session.notices


HANDED = ("lessons/session/bumpless.py", "himpc/controllers")
COMPILED = [name for name in CONTROLLERS if name != "himpc_printed"]


@pytest.mark.parametrize(
    "old",
    [
        name if name == "himpc" else pytest.param(name, marks=pytest.mark.nightly(*HANDED))
        for name in COMPILED
    ],
)
def test_a_switch_at_rest_is_bumpless(old: str) -> None:
    """The controller is switched to each later one in the table and back, without a bump. Thus every ordered
    pair is tested, except those with the controller in NumPy, see below. Those with HIMPC, the first one, are
    tested at every push."""
    session = at_rest(old)
    start = tip(session)
    for new in COMPILED[COMPILED.index(old) + 1 :]:
        switch(session, new, start)
        switch(session, old, start)


@pytest.mark.parametrize(
    "other",
    [
        name if name == "himpc" else pytest.param(name, marks=pytest.mark.nightly("himpc/printed.py"))
        for name in COMPILED
    ],
)
def test_a_switch_to_the_printed_equations_is_bumpless(other: str) -> None:
    """A tick of the controller in NumPy takes a hundred times as long as a compiled one."""
    session = at_rest(other)
    start = tip(session)
    switch(session, "himpc_printed", start)
    switch(session, other, start)


@pytest.mark.parametrize(
    "new",
    [*COMPILED, pytest.param("himpc_printed", marks=pytest.mark.nightly("himpc/printed.py"))],
)
def test_control_goes_on_after_a_switch(new: str) -> None:
    """The new controller follows a target. The posture is disabled, because it would stop the weighted
    controller half-way."""
    session = at_rest("hqp" if new == "himpc" else "himpc")
    start = tip(session)
    switch(session, new, start)
    session.post(Set("levels.posture.enabled", False))
    goal = start + np.array([0.0, 0.02, 0.01])
    session.post(MoveTarget("position", tuple(goal)))
    for _ in range(1000):
        session.tick()
    assert np.linalg.norm(tip(session) - goal) < 2e-3
    assert session.diverged_at is None


@pytest.mark.parametrize(("old", "new"), [("himpc", "hqp"), ("hqp", "himpc"), ("weighted", "osf")])
def test_a_switch_in_motion_is_smooth(old: str, new: str) -> None:
    """The target moves at up to 0.3 m/s while the controllers change: no torque jumps, and the hand
    arrives."""
    session = at_rest(old)
    goal = tip(session) + np.array([0.05, 0.15, -0.05])
    session.post(MoveTarget("position", tuple(goal)))
    for _ in range(250):
        session.tick()
    assert session.plan is not None
    assert np.linalg.norm(session.plant.v) > 0.1
    session.post(Set("controller", new))
    before = session.plant.tau
    for _ in range(1500):
        session.tick()
        now = session.plant.tau
        assert np.abs((now - before) / session.robot.tau_limit).max() < 0.05
        before = now
    assert np.linalg.norm(tip(session) - goal) < 2e-3


def test_the_new_controller_ends_up_alone() -> None:
    """After the transition, the session runs only the requested controller."""
    session = at_rest("himpc")
    session.post(Set("controller", "hqp"))
    session.tick()
    assert isinstance(session.controller, Handover)
    for _ in range(TICKS + 1):
        session.tick()
    assert type(session.controller).__name__ == "HQP"


def test_the_torque_goes_from_one_controller_to_the_other() -> None:
    """The blended torque starts at the old torque, ends at the new one and lies between them at every
    tick."""
    session = at_rest("himpc")
    session.post(Set("plant.payload_kg", 3.0))  # not in the nominal model, so the torques differ
    for _ in range(300):
        session.tick()
    session.post(Set("controller", "hqp"))
    handed, demands = [], []
    for _ in range(TICKS):
        held = session.plant.tau
        session.tick()
        assert session.plan is not None
        handed.append(session.plan.tau - held)
        demands.append(session.plan.levels[-1].U[0])  # the torque of the new controller without blending
    assert np.abs(handed[0]).max() < 1e-3 * np.abs(demands[0]).max()
    np.testing.assert_allclose(handed[-1], demands[-1], atol=1e-2)


def test_settings_reach_both_controllers_during_a_hand_over() -> None:
    """During the transition, a longer horizon, another period or a disabled level causes no notice and no
    motion."""
    session = at_rest("himpc")
    start = tip(session)
    session.post(Set("controller", "hiqp"))
    changes = [Set("horizon", 8), Set("T_s", 0.002), Set("levels.posture.enabled", False), Set("T_s", 0.001)]
    for change in changes:
        for _ in range(20):
            session.tick()
        assert isinstance(session.controller, Handover)
        session.post(change)
    for _ in range(TICKS):
        session.tick()
    assert not session.notices
    assert session.controller.settings.T_s == 0.001
    assert np.linalg.norm(tip(session) - start) < 1e-3


@pytest.mark.parametrize("new", ["himpc", "himpc_filtered"])
def test_a_controller_that_keeps_distances_keeps_them_during_the_hand_over(new: str) -> None:
    """OSF drives the hand at the table, and the switch happens just in time. Without a filter on the blended
    torque the hand would strike the table with more than 70 N. Another filter that sees the blended torques
    changes none of them."""
    session = TorqueSession(torque_scene("iiwa14-table"))
    session.post(Set("avoidance.on", True))
    session.post(Set("controller", "osf"))
    for _ in range(TICKS + 50):
        session.tick()
    session.post(MoveTarget("position", (0.556, 0.0, 0.10)))
    for _ in range(250):
        session.tick()
    session.post(Set("controller", new))
    session.drain()
    safe = DistanceFilter(session.robot, session.settings.for_controller())
    force = session.layout.fields["contact_force"]
    for _ in range(TICKS - 1):
        row = session.tick()
        assert isinstance(session.controller, Handover)
        plan, given = session.plan, session.controller_input
        assert plan is not None
        assert given is not None
        M_bar, near = np.array(session.settings.M_bar), observed_by(given.previews)
        again = safe(given.q, given.v, plan.tau_0, plan.tau, M_bar, plan.limits, near)
        np.testing.assert_allclose(again.tau, plan.tau, atol=1e-6)
        assert row[force] == 0.0
    for _ in range(700):
        assert session.tick()[force] == 0.0
    assert session.diverged_at is None


def test_changes_of_mind_and_a_reset() -> None:
    """Three switches during a transition remain smooth; a reset ends the transition at once."""
    session = at_rest("himpc")
    start, before = tip(session), session.plant.tau
    for name in ("hqp", "hiqp", "himpc"):
        session.post(Set("controller", name))
        for _ in range(30):
            session.tick()
            now = session.plant.tau
            assert np.abs((now - before) / session.robot.tau_limit).max() < 0.05
            before = now
    assert np.linalg.norm(tip(session) - start) < 1e-3
    session.post(Reset())
    session.tick()
    session.tick()
    assert not isinstance(session.controller, Handover)


def test_an_unknown_controller_changes_nothing() -> None:
    session = at_rest("himpc")
    session.post(Set("controller", "hmpc"))
    session.tick()
    assert "did you mean 'himpc'" in session.notices[0]
    assert session.settings.controller == "himpc"


def test_a_payload_is_picked_up_and_put_down_without_a_jump() -> None:
    """When the payload changes, the state does not jump. The controller, which has no information about it,
    keeps its target."""
    session = at_rest("himpc")
    start = tip(session)
    for kilograms in (2.0, 0.0):
        q, v, tau, t = session.plant.q, session.plant.v, session.plant.tau, session.plant.t
        session.post(Set("plant.payload_kg", kilograms))
        session.drain()
        assert session.plant.settings.payload_kg == kilograms
        for now, then in zip((session.plant.q, session.plant.v, session.plant.tau), (q, v, tau), strict=True):
            np.testing.assert_array_equal(now, then)
        assert session.plant.t == t
        heights = []
        for _ in range(1500):
            session.tick()
            heights.append(tip(session)[2] - start[2])
        assert 1e-5 < np.abs(heights).max() < 0.02
        assert np.linalg.norm(tip(session) - start) < 1e-4
    assert session.diverged_at is None
