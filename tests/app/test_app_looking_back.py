"""The last minute: motion, curves, figures and files, without a browser."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np
import pinocchio as pin
import pytest

from app.client.recording import KEPT, MOST, RATE, Frame, Recording
from app.link.choice import SceneChoice
from app.link.ring import Block
from app.view.pull import Grip, pulled, push_at
from app.worker.simulation import SimulationRunner
from himpc.telemetry import Layout
from lessons.events import Push
from lessons.plots.draw import draw
from lessons.plots.recorded import Recorded, run_picture
from lessons.recording.arrays import arrays, as_csv, as_npz, named
from lessons.recording.run import run as headless_run
from lessons.scenes.catalog import load_scene
from lessons.scenes.run_spec import RunSpec
from robots import Plant, PlantSettings, load_robot


@pytest.fixture(scope="module")
def body() -> Iterator[SimulationRunner]:
    made = SimulationRunner(SceneChoice(RunSpec("planar3-circle")))
    yield made
    made.close()


@pytest.fixture
def layout(body: SimulationRunner) -> Layout:
    return body.session.layout


@pytest.fixture
def recording(layout: Layout) -> Iterator[Recording]:
    block = Block(layout.size, 1)
    yield Recording(block, layout)
    block.close()


def rows_at(layout: Layout, times: np.ndarray, field: str, values: np.ndarray) -> np.ndarray:
    rows = np.zeros((len(times), layout.size))
    rows[:, layout.fields["t"].start] = times
    rows[:, layout.fields[field].start] = values
    return rows


# ---------------------------------------------------------------- motion


def frame(t: float, x: float = 0.0, turn: float = 0.0) -> Frame:
    pose = np.array([x, 0.0, 0.0, np.cos(0.5 * turn), 0.0, 0.0, np.sin(0.5 * turn)])
    return Frame(t, pose[None], None)


def test_the_recording_shows_any_moment_of_the_last_minute(recording: Recording) -> None:
    assert recording.frame(1.0) is None and recording.span == (0.0, 0.0)
    for k in range(30 * 90):
        recording.add(frame(k / 30, x=k / 30, turn=0.02 * k))
    first, last = recording.span
    assert last - first == pytest.approx(KEPT, abs=0.05)
    found = recording.frame(72.345)
    assert found is not None and found.poses[0, 0] == pytest.approx(72.345)
    expected = frame(0.0, turn=0.02 * 30 * 72.345).poses[0, 3:]
    assert abs(found.poses[0, 3:] @ expected) == pytest.approx(1.0, abs=1e-6)
    times = [each.t for each in recording.frames(70.0, 71.0)]
    assert len(times) == pytest.approx(30, abs=1) and times == sorted(times)


def test_slow_motion_needs_no_more_room_and_a_reset_empties_the_recording(recording: Recording) -> None:
    for k in range(3000):
        recording.add(frame(1e-3 * k))
    assert len(recording.frames(-1.0, 10.0)) < 3.0 * 30 + 3
    found = recording.frame(2.999)
    assert found is not None and found.t == 2.999  # the newest moment is always stored
    recording.add(frame(0.0))
    assert recording.span == (0.0, 0.0)


@pytest.mark.parametrize("rate", [30.0, 10.0])
def test_the_recording_holds_no_more_than_a_minute(recording: Recording, rate: float) -> None:
    """The history has at most a minute of frames, also if a busy machine shows fewer frames per second."""
    lengths: list[int] = []
    for k in range(round(150 * rate)):
        recording.add(frame(k / rate))
        lengths.append(len(recording.frames(-1.0, 1e3)))
    filled = lengths[round(61 * rate) :]
    assert max(filled) - min(filled) <= 1
    assert max(filled) <= KEPT * rate + 1


# ---------------------------------------------------------------- curves


def test_plots_of_the_past_are_those_that_were_seen(recording: Recording, layout: Layout) -> None:
    block, seen = recording.block, {}
    for k in range(40):
        times = 0.5 * k + 0.002 * np.arange(250)
        for row in rows_at(layout, times, "step_us", np.sin(7 * times)):
            block.write(row)
        recording.pull()
        seen[round(float(times[-1]), 3)] = recording.window().columns(layout.fields["step_us"])
    for t in (19.998, 12.498, 9.998):
        assert np.array_equal(recording.window(t).columns(layout.fields["step_us"]), seen[t], equal_nan=True)
        assert 0.0 <= t - recording.row(t)[layout.fields["t"]][0] < 1 / RATE
    block.write(rows_at(layout, np.zeros(1), "step_us", np.ones(1))[0])
    recording.pull()
    assert np.nanmax(recording.window().columns(layout.fields["step_us"])) == 1.0  # a new run
    assert np.isfinite(recording.window().columns(layout.fields["t"])).sum() == 2


def test_a_run_continues_with_another_stack(recording: Recording, layout: Layout) -> None:
    """The recording is moved to the new layout: the same poses, rows and curves, without the columns that
    only the old stack has."""
    fewer = replace(layout, fields={k: v for k, v in layout.fields.items() if k != "q_measured"})
    for k in range(70 * 30):
        times = (k + np.arange(1, 5) / 4) / 30
        recording.take(rows_at(layout, times, "unsolved", np.sin(7 * times)))
        recording.add(frame(times[-1], x=times[-1]))
    other = Block(layout.size, 1)
    moved = recording.under(other, fewer)
    for field in ("t", "unsolved"):
        columns = layout.fields[field]
        for which in (Recording.minute, Recording.whole):
            assert np.array_equal(which(moved)[:, columns], which(recording)[:, columns])
        assert np.array_equal(moved.row(33.3)[columns], recording.row(33.3)[columns])
        curves = recording.window(50.0).columns(columns)
        assert np.isfinite(curves).all() and np.array_equal(moved.window(50.0).columns(columns), curves)
    assert moved.span == recording.span and moved.statistics.result() is None
    for each in (moved, recording):
        each.take(rows_at(layout, np.array([70.1]), "unsolved", np.ones(1)))
    assert np.array_equal(moved.whole()[:, 0], recording.whole()[:, 0])
    other.close()


def test_two_clocks_of_one_time_have_the_same_buckets(layout: Layout) -> None:
    """A ghost with another control period or a small delay has its samples in the same buckets as its
    leader."""
    found = []
    for period, late in ((0.001, 0), (0.004, 3)):
        block = Block(layout.size, 1)
        recording = Recording(block, layout)
        times = np.arange(0.0, 2.0, period)[: len(np.arange(0.0, 2.0, period)) - late]
        for row in rows_at(layout, times, "step_us", np.floor(times / 0.05 + 1e-6)):
            block.write(row)
        recording.pull()
        found.append(recording.window(1.9999).columns(layout.fields["step_us"]))
        block.close()
    assert np.array_equal(found[0], found[1], equal_nan=True)


def test_a_period_longer_than_a_bucket_leaves_no_gaps(recording: Recording, layout: Layout) -> None:
    recording.take(rows_at(layout, 0.12 * np.arange(20), "step_us", 1.0 + np.arange(20.0)))
    seen = recording.window().columns(layout.fields["step_us"])[:, 0]
    known = seen[np.isfinite(seen)]
    assert len(known) == 2 * (1 + round(19 * 0.12 / 0.05 - 0.1)) and (np.diff(known) >= 0).all()
    assert set(known) == set(1.0 + np.arange(20.0))


# ---------------------------------------------------------------- figures and files


def test_the_figures_count_every_tick_of_the_run(recording: Recording, layout: Layout) -> None:
    assert recording.statistics.result() is None
    name = layout.tasks[0].name
    for start in (0, 100):
        rows = rows_at(layout, 1e-3 * (start + np.arange(100)), "unsolved", np.ones(100))
        rows[:, layout.fields[f"error/{name}"].start] = 3.0 if start else 1.0
        rows[:, layout.fields["tau_upper"]], rows[:, layout.fields["tau_lower"]] = 2.0, -4.0
        rows[:, layout.fields["tau_demand"].start] = -3.0
        rows[:, layout.fields["step_us"]] = 500.0
        recording.take(rows)
    found = recording.statistics.result()
    assert found is not None and found.rmse[name] == pytest.approx(np.sqrt(5.0))
    assert found.torque_share == 0.75 and found.unsolved == 200 and found.seconds == pytest.approx(0.199)
    assert found.step_ms == pytest.approx(0.5, rel=0.03) and found.slow_ms == pytest.approx(0.5, rel=0.03)
    recording.take(rows_at(layout, np.zeros(1), "unsolved", np.zeros(1)))
    found = recording.statistics.result()
    assert found is not None and found.unsolved == 0 and found.rmse[name] == 0.0


def test_a_recording_of_any_length_stays_small_and_exact(recording: Recording, layout: Layout) -> None:
    for minute in range(8):
        assert recording.full == (minute > 2)  # of 14,000 rows a minute has 6,000
        times = 60.0 * minute + 0.002 * np.arange(30_000)
        recording.take(rows_at(layout, times, "step_us", times**2))
    minute, whole = recording.minute(), recording.whole()
    t, value = layout.fields["t"].start, layout.fields["step_us"].start
    assert len(minute) == 6000 and minute[0, t] == pytest.approx(420.0)
    assert MOST // 3 < len(whole) < MOST and whole[0, t] == 0.0 and whole[-1, t] > 479.5
    assert np.unique(np.round(np.diff(whole[:, t]), 6)).size == 1  # evenly spaced
    for rows in (minute, whole):
        assert np.array_equal(rows[:, value], rows[:, t] ** 2)
    recording.take(rows_at(layout, np.zeros(1), "step_us", np.ones(1)))
    assert len(recording.whole()) == len(recording.minute()) == 1


def test_the_last_minute_of_a_slow_controller_is_a_minute(recording: Recording, layout: Layout) -> None:
    recording.take(rows_at(layout, 0.1 * np.arange(900), "unsolved", np.zeros(900)))
    assert len(recording.minute()) == pytest.approx(600, abs=1) and len(recording.whole()) == 900


@pytest.fixture(scope="module")
def run(body: SimulationRunner) -> Recorded:
    recording = Recording(body.block, body.session.layout)
    for _ in range(6):
        body.tick(50)
        recording.pull()
    return Recorded(recording.layout, recording.whole())


def test_files_hold_what_was_recorded(body: SimulationRunner, run: Recorded) -> None:
    robot, now = body.session.robot, body.session.settings
    data = np.load(io.BytesIO(as_npz(named(robot, now, run.layout, run.rows, {"scene": "x"}))))
    assert np.allclose(np.diff(data["t"]), 0.01) and len(data["t"]) == 30
    assert np.array_equal(data["q"], run["q"]) and data["q"].shape == (30, 3)
    settings = json.loads(str(data["settings"]))
    assert settings["scene"] == "x" and settings["in_force"]["horizon"] == body.session.settings.horizon
    assert str(data["tip"]) == robot.tip and np.array_equal(data["a_max"], robot.a_max)
    headless = arrays(headless_run(load_scene("planar3-circle"), 0.01), {})
    assert {name: each.ndim for name, each in data.items()} == {n: np.ndim(a) for n, a in headless.items()}
    lines = list(csv.DictReader(io.StringIO(as_csv(run.layout, run.rows).decode())))
    assert len(lines) == 30
    joint, task = run.layout.joints[1], run.layout.tasks[0]
    assert float(lines[7][f"q[{joint}]"]) == pytest.approx(run["q"][7, 1], rel=1e-8)
    error = float(lines[7][f"error/{task.name}[{task.coordinates[0]}]"])
    assert error == pytest.approx(run[f"error/{task.name}"][7, 0], rel=1e-8)


def test_the_picture_is_drawn_with_and_without_a_ghost(run: Recorded, tmp_path: Path) -> None:
    sizes = []
    for ghost in (None, Recorded(run.layout, 0.5 * run.rows)):
        picture = run_picture("run", run, ghost, 1e-3)
        data = draw(picture, tmp_path).read_bytes()
        assert data.startswith(b"\x89PNG")
        sizes.append(len(picture.panels[0].curves))  # pyright: ignore[reportAttributeAccessIssue]
    assert sizes == [len(run.layout.tasks), 2 * len(run.layout.tasks)]


# ---------------------------------------------------------------- pulling at a link


def test_a_pull_acts_at_the_point_that_is_held() -> None:
    """The acceleration under the push equals that of the force alone at the grasped point, J(point)ᵀ f."""
    robot, settings = load_robot("iiwa14"), PlantSettings(payload_kg=2.0)
    plant = Plant(robot, settings)
    rng = np.random.default_rng(5)
    plant.reset(robot.home + 0.3 * rng.standard_normal(robot.n))
    joint, frame_name = robot.n, robot.tip
    _, point = plant.frame_pose(frame_name)
    data = robot.model.createData()
    pin.forwardKinematics(robot.model, data, plant.q)
    placement = data.oMi[joint]
    x, y, z, w = pin.Quaternion(placement.rotation).coeffs()
    pose = np.array([*placement.translation, w, x, y, z])
    grip = Grip(
        joint, placement.rotation.T @ (point - placement.translation), point + np.array([0.1, -0.05, 0.2])
    )
    poses = np.tile(pose, (robot.n + 1, 1))
    held, force = pulled(grip, poses, mass=20.0)
    assert np.allclose(held, point, atol=1e-9) and np.linalg.norm(force) > 10.0
    free = plant.acceleration(plant.tau)
    push = push_at(robot, settings, joint, pose, held, force)
    assert isinstance(push, Push)
    plant.push(push.body, np.array(push.force), np.array(push.torque))
    gained = plant.mass_matrix() @ (plant.acceleration(plant.tau) - free)
    assert np.allclose(gained, plant.jacobian(frame_name)[:3].T @ force, atol=1e-6)
    far = Grip(joint, grip.at, point + np.array([50.0, 0.0, 0.0]))
    assert np.linalg.norm(pulled(far, poses, mass=20.0)[1]) == pytest.approx(70.0)
