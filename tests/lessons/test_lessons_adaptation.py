"""The adaptation of M̄ has these effects on the robots of the scenes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from session_rows import field, rows_of

from lessons.events import Event, MoveTarget, Set
from lessons.experiments.eigenvalues import EigenvalueJob
from lessons.scenes.catalog import torque_scene
from lessons.scenes.run_spec import RunSpec
from lessons.session.torque import TorqueSession


def session_of(name: str, **settings: object) -> TorqueSession:
    scene = torque_scene(name)
    taken = scene.settings
    for path, value in settings.items():
        taken = taken.changed(path.replace("__", "."), value)
    return TorqueSession(replace(scene, settings=taken))


def error(name: str, payload_kg: float, adapt: bool) -> float:
    """Returns the RMS of the distance of the hand from its reference, m, from the end of the first to the end
    of the fourth second. A target that can be dragged jumps by up to 10 cm every half second."""
    session = session_of(name, plant__payload_kg=payload_kg, M_bar_adapt=adapt)
    target, rng = session.target("position"), np.random.default_rng(0)
    start = None if target is None else np.array(target.raw)
    rows = []
    for tick in range(4000):
        if start is not None and tick % 500 == 250:
            session.post(MoveTarget("position", tuple((start + rng.uniform(-0.1, 0.1, 3)).tolist())))
        rows.append(session.tick().copy())
    assert session.diverged_at is None
    found = field(session, np.array(rows[1000:]), "error/position")
    return float(np.sqrt((found**2).sum(axis=1).mean()))


@pytest.mark.parametrize(
    "name",
    [
        "iiwa14-circle",
        pytest.param(
            "iiwa14-hold", marks=pytest.mark.nightly("himpc/controllers", "himpc/tick", "robots/plant.py")
        ),
    ],
)
def test_a_payload_costs_no_error(name: str) -> None:
    """With 0.5 to 6 kg at the flange and adaptation, the error of the hand is smaller than without payload
    and without adaptation. On the circle, 2 kg make the arm unstable with the M̄ of the scene."""
    alone = error(name, 0.0, adapt=False)
    for payload_kg in (0.0, 0.5, 2.0, 6.0):
        assert error(name, payload_kg, adapt=True) < alone, payload_kg
    if name == "iiwa14-circle":
        assert error(name, 2.0, adapt=False) > 30.0 * alone


@pytest.mark.parametrize(
    ("setting", "later"),
    [
        ("plant.payload_kg=6", None),
        ("plant.payload_kg=2", 4.0),
        ("plant.payload_kg=4", 0.0),
        ("plant.encoder_resolution_deg=0.001", None),
    ],
)
def test_no_eigenvalue_passes_2(setting: str, later: float | None) -> None:
    """λ_max(M⁻¹M̄) is below 2 at every tick: for a heavy payload, for a payload that changes or falls off
    during the run, and for coarse encoders."""
    spec = RunSpec("iiwa14-circle", set=(setting, "M_bar_adapt=true"))
    told = EigenvalueJob(spec, payload_later=later).do().summary
    assert told["largest"] < 2.0
    assert told["rms_mm"] < 3.0


@pytest.mark.parametrize("on", [True, False])
def test_the_switch_does_not_jump_the_torque(on: bool) -> None:
    """If adaptation is switched on in the middle of the circle, the torque of that tick is bitwise unchanged.
    After a switch in either direction, no tick changes the torque by more than twice the largest change
    before."""
    sessions = [session_of("iiwa14-circle", M_bar_adapt=not on) for _ in range(2)]
    before, _ = (rows_of(session, 1500) for session in sessions)
    event: Event = Set("M_bar_adapt", on)
    sessions[0].post(event)
    after, plain = (rows_of(session, 500) for session in sessions)
    step, usual = (field(sessions[0], rows, "delta_tau") for rows in (after, before[500:]))
    limit = sessions[0].robot.tau_limit
    if on:
        np.testing.assert_array_equal(*(field(sessions[0], rows, "tau_demand")[0] for rows in (after, plain)))
    assert (np.abs(step) / limit).max() <= 2.0 * (np.abs(usual) / limit).max()


@pytest.mark.parametrize("controller", ["himpc", "hiqp"])
def test_kernel_and_printed_equations_take_the_same_M_bar(controller: str) -> None:
    """The torques agree to 1e-8 N·m while M̄ changes, and a repeated run gives bitwise the same torques. HIQP
    is HIMPC with one knot."""
    N = 1 if controller == "hiqp" else 5
    runs = [
        session_of("iiwa14-circle", M_bar_adapt=True, plant__payload_kg=2.0, controller=each, horizon=N)
        for each in (controller, "himpc_printed", controller)
    ]
    compiled, printed, again = (rows_of(session, 400) for session in runs)
    torque = [field(runs[0], rows, "tau_demand") for rows in (compiled, printed, again)]
    assert np.abs(torque[0] - torque[1]).max() <= 1e-8
    np.testing.assert_array_equal(torque[0], torque[2])
    plan = runs[0].plan
    assert plan is not None and plan.M_bar is not None
    assert plan.M_bar[0] > 1.5 * runs[0].settings.M_bar[0]


def test_the_gauge_shows_the_M_bar_in_force() -> None:
    """The gauge decreases while M̄ grows; without adaptation, it is the gauge of the set M̄."""
    moving, fixed = (session_of("iiwa14-circle", M_bar_adapt=adapt) for adapt in (True, False))
    gauges = [field(each, rows_of(each, 800), "gauge_radius")[:, 0] for each in (moving, fixed)]
    assert gauges[0][0] == gauges[1][0]
    assert gauges[0][-1] < gauges[1][-1] - 0.02
    assert fixed.plan is not None and fixed.plan.M_bar is None


def test_a_payload_that_is_dropped_is_noticed() -> None:
    """If 4 kg fall off in the middle of the circle, the hand stays within 5 cm and becomes as accurate as
    before."""
    session = session_of("iiwa14-circle", M_bar_adapt=True, plant__payload_kg=4.0)
    rows_of(session, 2000)
    session.post(Set("plant.payload_kg", 0.0))
    distance = np.linalg.norm(field(session, rows_of(session, 2000), "error/position"), axis=1)
    assert distance.max() < 0.05
    assert distance[500:].max() < 5e-3


def test_switched_on_early_it_brings_an_arm_back() -> None:
    """If adaptation is switched on after one second of growing errors, it brings the arm back to its
    circle."""
    session = session_of("iiwa14-circle", M_bar_adapt=False, plant__payload_kg=2.0)
    lost = np.linalg.norm(field(session, rows_of(session, 1000), "error/position"), axis=1)
    session.post(Set("M_bar_adapt", True))
    back = np.linalg.norm(field(session, rows_of(session, 5000), "error/position"), axis=1)
    assert lost.max() > 0.02
    assert back[-1000:].max() < 2e-3


def test_coarse_encoders_do_not_disturb_it() -> None:
    """With 2 kg and encoders of 0.001°, the error is below 3 mm RMS; without adaptation it is above 30 mm."""
    spec = RunSpec("iiwa14-circle", set=("plant.payload_kg=2", "plant.encoder_resolution_deg=0.001"))
    assert EigenvalueJob(spec.but("M_bar_adapt=true")).do().summary["rms_mm"] < 3.0
    assert EigenvalueJob(spec).do().summary["rms_mm"] > 30.0
