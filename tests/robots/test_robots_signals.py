"""The plant models how motors change a command and how encoders change a position. It is deterministic, and
its settings may change during a run."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from robots import InputError, Plant, PlantSettings, load_robot

ROBOT = load_robot("planar3")
IIWA = load_robot("iiwa14")


def test_saturation_clips_and_can_be_switched_off() -> None:
    too_much = np.array([100.0, -100.0, 1.0])
    np.testing.assert_array_equal(Plant(ROBOT).step(too_much, 1e-3), [4.0, -4.0, 1.0])
    plant = Plant(ROBOT, PlantSettings(saturate=False))
    np.testing.assert_array_equal(plant.step(too_much, 1e-3), too_much)


@pytest.mark.parametrize("delay_ms", [1.0, 3.0, 7.0])
def test_delay_holds_a_command_back(delay_ms: float) -> None:
    plant = Plant(ROBOT, PlantSettings(delay_ms=delay_ms))
    plant.reset(ROBOT.home, tau=np.zeros(3))
    applied = [plant.step(np.full(3, 1.0 + k), 1e-3)[0] for k in range(12)]
    waiting = round(delay_ms)
    np.testing.assert_array_equal(applied[:waiting], np.zeros(waiting))
    np.testing.assert_array_equal(np.clip(np.arange(1.0, 13.0 - waiting), 0, 4), applied[waiting:])


def test_lag_is_the_exact_first_order_response() -> None:
    plant = Plant(ROBOT, PlantSettings(torque_lag_ms=5.0))
    plant.reset(ROBOT.home, tau=np.zeros(3))
    applied = [plant.step(np.ones(3), 1e-3)[0] for _ in range(20)]
    np.testing.assert_allclose(applied, 1.0 - np.exp(-np.arange(1, 21) / 5.0), atol=1e-12)


def test_motors_start_with_the_holding_torque() -> None:
    plant = Plant(IIWA, PlantSettings(delay_ms=5.0, torque_lag_ms=3.0, payload_kg=2.0))
    hold = plant.holding_torque()
    np.testing.assert_array_equal(plant.tau, hold)
    for _ in range(100):
        plant.step(hold, 1e-3)
    np.testing.assert_allclose(plant.q, IIWA.home, atol=1e-9)


def test_encoders_round_and_difference() -> None:
    resolution = np.radians(0.05)
    plant = Plant(IIWA, PlantSettings(encoder_resolution_deg=0.05))
    plant.reset(IIWA.home, np.full(7, 0.3))
    period = 2e-3
    before = plant.measure(period)
    np.testing.assert_allclose(before.v, 0.3, atol=resolution / period)
    for _ in range(30):
        plant.step(plant.holding_torque() + 1.0, period)
        now = plant.measure(period)
        steps = now.q / resolution
        np.testing.assert_allclose(steps, np.round(steps), atol=1e-9)
        assert np.abs(now.q - plant.q).max() <= 0.5 * resolution + 1e-12
        np.testing.assert_allclose(now.v, (now.q - before.q) / period, atol=1e-9)
        again = plant.measure(period)
        np.testing.assert_array_equal(again.v, now.v)
        before = now


def test_ideal_encoders_tell_the_truth() -> None:
    plant = Plant(IIWA)
    plant.reset(IIWA.home + 0.1, np.linspace(-1, 1, 7))
    plant.step(np.zeros(7), 1e-3)
    state = plant.measure(1e-3)
    np.testing.assert_array_equal(state.q, plant.q)
    np.testing.assert_array_equal(state.v, plant.v)
    assert state.t == pytest.approx(1e-3)


def test_a_long_period_is_split_into_equal_internal_steps() -> None:
    coarse, fine = Plant(IIWA), Plant(IIWA)
    for plant in (coarse, fine):
        plant.reset(IIWA.home, np.full(7, 0.2))
    tau = coarse.holding_torque()
    for _ in range(8):
        coarse.step(tau, 2.5e-3)
    for _ in range(24):
        fine.step(tau, 2.5e-3 / 3)
    np.testing.assert_array_equal(coarse.q, fine.q)
    assert coarse.t == pytest.approx(0.02)


def rich_run() -> np.ndarray:
    plant = Plant(
        IIWA, PlantSettings(friction=0.3, damping=0.2, encoder_resolution_deg=0.01, torque_lag_ms=2.0)
    )
    rng = np.random.default_rng(3)
    rows = []
    for k in range(60):
        if k == 20:
            plant.push("link_5", (10.0, 0.0, -5.0))
        if k == 40:
            plant.configure(dataclasses.replace(plant.settings, payload_kg=1.0, delay_ms=2.0))
        state = plant.measure(1e-3)
        rows.append(np.concatenate([state.q, state.v, plant.step(rng.normal(0, 20, 7), 1e-3), plant.q]))
    return np.array(rows)


def test_the_same_calls_give_the_same_bits() -> None:
    assert rich_run().tobytes() == rich_run().tobytes()


def test_queries_do_not_disturb_the_simulation() -> None:
    settings_ = PlantSettings(friction=0.4, damping=0.1)
    quiet, asked = Plant(IIWA, settings_), Plant(IIWA, settings_)
    for _ in range(30):
        tau = quiet.holding_torque() + 2.0
        quiet.step(tau, 1e-3)
        for query in (asked.mass_matrix, asked.bias, asked.holding_torque):
            query()
        asked.jacobian("flange")
        asked.frame_pose("flange")
        asked.acceleration(np.zeros(7))
        asked.measure(1e-3)
        asked.step(tau, 1e-3)
    assert quiet.q.tobytes() == asked.q.tobytes()


def test_configure_keeps_the_state_and_the_memory() -> None:
    plant = Plant(IIWA, PlantSettings(delay_ms=3.0))
    plant.reset(IIWA.home, np.full(7, 0.1), np.full(7, 5.0))
    plant.push("link_4", (0.0, 20.0, 0.0))
    for _ in range(5):
        plant.step(np.full(7, 8.0), 1e-3)
    q, v, t, tau = plant.q, plant.v, plant.t, plant.tau
    pushed = plant.acceleration(tau)
    plant.configure(dataclasses.replace(plant.settings, encoder_resolution_deg=0.01))
    np.testing.assert_array_equal(plant.q, q)
    np.testing.assert_array_equal(plant.v, v)
    np.testing.assert_array_equal(plant.tau, tau)
    assert plant.t == t
    np.testing.assert_allclose(plant.acceleration(tau), pushed, atol=1e-9)
    np.testing.assert_array_equal(plant.step(np.zeros(7), 1e-3), np.full(7, 8.0))


def test_static_friction_holds_a_joint() -> None:
    plant = Plant(ROBOT, PlantSettings(friction=1.0))
    plant.reset(ROBOT.home, tau=np.zeros(3))
    for _ in range(500):
        plant.step(np.full(3, 0.5), 1e-3)
    assert np.abs(plant.v).max() < 1e-4
    assert np.abs(plant.q - ROBOT.home).max() < 1e-4


def test_divergence_shows_and_leaves_no_log(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    plant = Plant(ROBOT, PlantSettings(saturate=False))
    for _ in range(50):
        plant.step(np.full(3, 1e6), 1e-3)
    assert plant.broken
    assert np.isfinite(plant.q).all() and np.isfinite(plant.v).all()
    assert plant.t == pytest.approx(0.05)
    assert list(tmp_path.iterdir()) == []
    assert capfd.readouterr().err == ""


def test_friction_and_damping_slow_the_arm_down() -> None:
    speeds = []
    for chosen in (PlantSettings(), PlantSettings(damping=0.2), PlantSettings(friction=0.2)):
        plant = Plant(ROBOT, chosen)
        plant.reset(ROBOT.home, np.full(3, 1.0))
        for _ in range(300):
            plant.step(np.zeros(3), 1e-3)
        speeds.append(np.abs(plant.v).max())
    assert speeds[1] < 0.5 * speeds[0]
    assert speeds[2] < 0.5 * speeds[0]


@pytest.mark.parametrize(
    "bad", [np.array([np.nan, 0, 0]), np.array([np.inf, 0, 0]), np.zeros(2), np.zeros((3, 1))]
)
def test_a_bad_command_is_never_simulated(bad: np.ndarray) -> None:
    plant = Plant(ROBOT)
    with pytest.raises(ValueError, match="3 finite numbers"):
        plant.step(bad, 1e-3)
    assert plant.t == 0.0


BAD_SETTINGS = [
    ({"payload_kg": -1.0}, "payload_kg"),
    ({"payload_kg": float("nan")}, "payload_kg"),
    ({"friction": (0.1, -0.1, 0.0)}, "friction"),
    ({"damping": float("inf")}, "damping"),
    ({"armature": "much"}, "armature"),
    ({"inertia_scale": 0.0}, "inertia_scale"),
    ({"delay_ms": 1e6}, "delay_ms"),
    ({"saturate": 1}, "saturate"),
    ({"encoder_resolution_deg": None}, "encoder_resolution_deg"),
]


@pytest.mark.parametrize(("values", "field"), BAD_SETTINGS)
def test_bad_settings_name_their_field(values: dict[str, object], field: str) -> None:
    with pytest.raises(InputError, match=field):
        PlantSettings(**values)  # pyright: ignore[reportArgumentType]


@pytest.mark.parametrize("field", ["friction", "damping", "armature", "mass_scale", "inertia_scale"])
def test_a_list_of_the_wrong_length_is_refused(field: str) -> None:
    short = dataclasses.replace(PlantSettings(), **{field: (0.1, 0.1)})
    with pytest.raises(InputError, match=f"{field} has 2 values"):
        Plant(ROBOT, short)


@settings(max_examples=25, deadline=None)
@given(
    st.builds(
        PlantSettings,
        payload_kg=st.floats(0, 3),
        friction=st.floats(0, 1),
        damping=st.floats(0, 1),
        armature=st.floats(0, 0.2),
        inertia_scale=st.floats(0.5, 2),
        encoder_resolution_deg=st.sampled_from([0.0, 1e-3, 0.1]),
        torque_lag_ms=st.floats(0, 10),
        delay_ms=st.floats(0, 10),
    )
)
def test_any_allowed_plant_stays_finite_and_inside_its_torque_limits(chosen: PlantSettings) -> None:
    plant = Plant(ROBOT, chosen)
    rng = np.random.default_rng(0)
    for _ in range(40):
        applied = plant.step(rng.normal(0.0, 10.0, 3), 1e-3)
        assert np.all(np.abs(applied) <= ROBOT.tau_limit + 1e-12)
    state = plant.measure(1e-3)
    assert np.all(np.isfinite(np.concatenate([state.q, state.v])))
