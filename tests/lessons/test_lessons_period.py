"""T_s is limited by M̄: time-delay estimation lags by T_s/λ_min(M⁻¹M̄)."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from lessons.events import MoveTarget, Set
from lessons.recording.run import run
from lessons.runs.named import check_scene
from lessons.scenes.catalog import torque_scene
from lessons.scenes.names import SCENES
from lessons.scenes.run_spec import RunSpec
from lessons.session.start import begin
from lessons.session.torque import TorqueSession
from lessons.settings.period import USUAL, longest_period, warning
from robots import InputError

DEEP = (0.606, 0.05, 0.098)
"""Below the surface of the table, m."""


@pytest.mark.parametrize(("name", "longest"), [
    ("panda-hold", 2.1), ("iiwa14-hold", 2.5), ("planar3-hold", 19.0), ("ridgeback-ur10-hold", 5.8),
    ("baxter-tray", 14.0), ("iiwa14-circle", 5.7),
])  # fmt: skip
def test_a_longer_period_is_refused_wherever_it_comes_from(name: str, longest: float) -> None:
    """A script, a code and a lesson begin a session; the page changes a session. All get the same sentence,
    which names the longest period."""
    scene = torque_scene(name)
    assert longest_period(scene.robot, scene.settings) == pytest.approx(1e-3 * longest)
    begin(RunSpec(name, set=(f"T_s={1e-3 * longest:g}",)).prepared())
    with pytest.raises(InputError, match=f"Choose at most {longest:.2g} ms") as refused:
        begin(RunSpec(name, set=("T_s=0.02",)).prepared())
    session = TorqueSession(scene)
    session.post(Set("T_s", 0.02))
    session.tick()
    assert session.notices == [str(refused.value)] and session.settings == scene.settings


@pytest.mark.parametrize("change", [
    Set("M_bar_scale", 0.5), Set("M_bar.5", 1e-3), Set("plant.armature", 0.1), Set("controller", "himpc"),
], ids=str)  # fmt: skip
def test_a_change_that_makes_the_period_too_long_is_refused(change: Set) -> None:
    """With half of M̄ at 2 ms, panda-post pressed on its post with 1.2 kN, at twice its speed limit. More
    inertia, and a controller without a model, have the same lag."""
    settings = ("T_s=0.002",) if change.path != "controller" else ("controller=osf", "T_s=0.004")
    session = begin(RunSpec("panda-post", set=settings).prepared())
    session.post(change)
    session.tick()
    (told,) = session.notices
    assert "is too long for panda with this M̄" in told and session.log == []


def test_with_the_usual_period_a_small_M_bar_is_told_once() -> None:
    """Lessons show what a small M̄ does, so it is not refused. The sentence comes when the robot begins to
    lag, not with each further step of the slider."""
    session = TorqueSession(torque_scene("iiwa14-table"))
    for scale in (0.9, 0.3, 0.25, 1.0, 0.2):
        session.post(Set("M_bar_scale", scale))
    session.tick()
    assert len(session.log) == 5 and len(session.notices) == 2
    assert all("Choose at most" in told and "a larger M̄" in told for told in session.notices)


def test_gains_that_are_too_large_for_the_lag_are_told() -> None:
    """There are three ways to the same lag: the gains, the period, M̄. With these gains the hand of the iiwa
    is 79 mm away from its target 2 s after a drag; a larger K_v damps it."""
    stiff, damped = "levels.1.K_p=500", "levels.1.K_v=45"
    for first, then, told in (
        ((), Set("levels.1.K_p", 500.0), True),
        ((damped,), Set("levels.1.K_p", 500.0), False),
        ((stiff, "T_s=0.0002"), Set("T_s", 0.001), True),
        ((stiff, "T_s=0.0002"), Set("M_bar_scale", 0.2), True),
    ):
        session = begin(RunSpec("iiwa14-hold", set=first).prepared())
        session.post(then)
        session.tick()
        assert len(session.log) == 1 and len(session.notices) == int(told)
        assert all("K_p of position is too large for iiwa14" in notice for notice in session.notices)


@pytest.mark.parametrize("name", [name for name in SCENES if name != "hold"])
def test_no_scene_swings_as_it_is(name: str) -> None:
    scene = torque_scene(name)
    assert scene.settings.T_s <= USUAL and warning(scene.robot, scene.settings) == ""


def test_codes_with_a_model_or_own_controllers_keep_their_period() -> None:
    """Nothing is known about a controller of one's own."""
    scene = torque_scene("panda-hold")
    for settings in (
        scene.settings.changed("controller", "osf"),
        scene.settings.changed("controller", "hqp"),
    ):
        assert longest_period(scene.robot, settings) == np.inf
        begin(RunSpec("panda-hold", controller=settings.controller, set=("T_s=0.02",)).prepared())


@pytest.mark.parametrize(
    ("name", "T_s", "worst"), [("panda-hold", 0.002, 10.0), ("iiwa14-hold", 0.0025, 15.0)]
)
def test_an_arm_follows_with_the_longest_period(name: str, T_s: float, worst: float) -> None:
    """2 s after a drag of 140 mm and more the hand is at most 15 mm away; with 4 ms it was 50 mm away."""
    scene = torque_scene(name)
    session = TorqueSession(replace(scene, settings=scene.settings.changed("T_s", T_s)))
    there = session.plant.frame_pose(session.robot.tip)[1] + [-0.08, 0.08, -0.08]
    session.post(MoveTarget("position", tuple(map(float, there))))
    while session.t < 2.5:
        session.tick()
    assert 1e3 * np.linalg.norm(session.plant.frame_pose(session.robot.tip)[1] - there) < worst


def test_a_scene_of_ones_own_may_show_what_a_notice_is_about() -> None:
    """A refused event of a file's scene is an error of the file; an event that leaves a notice is not."""
    scene = torque_scene("panda-hold")
    check_scene(replace(scene, events=((0.0, Set("M_bar_scale", 0.3)), (1.0, Set("M_bar_scale", 1.0)))))
    with pytest.raises(InputError, match="T_s = 10 ms is too long for panda"):
        check_scene(replace(scene, events=((0.0, Set("M_bar_scale", 0.3)), (1.0, Set("T_s", 0.01)))))


@pytest.mark.parametrize(("change", "touches"), [
    ((), True), (("M_bar_scale=0.5",), False), (("T_s=0.002",), False),
    (("limits.torque=false", "plant.saturate=false"), False),
], ids=str)  # fmt: skip
def test_sensors_that_are_too_coarse_for_the_motors_are_told(change: tuple[str, ...], touches: bool) -> None:
    """With encoders of 0.1°, one digit changes the torque of joint 2 by 366 N·m of 320 N·m: the motors are
    often at their limits, and the iiwa touches the table with hundreds of N although it keeps distances. It
    does not with half of M̄, with twice the period, or without torque limits."""
    coarse = ("plant.encoder_resolution_deg=0.1", *change)
    session = begin(RunSpec("iiwa14-table", set=change).prepared())
    session.post(Set("plant.encoder_resolution_deg", 0.1))
    session.tick()
    told = [notice for notice in session.notices if "One digit of the encoder of joint_2" in notice]
    assert len(told) == len(session.notices) == int(touches)
    scene = RunSpec("iiwa14-table", set=coarse).prepared()
    events = ((0.0, MoveTarget("position", DEEP)),)
    force = run(replace(scene, events=events), 3.0)["contact_force"].max()
    assert force > 100.0 if touches else force == 0.0
