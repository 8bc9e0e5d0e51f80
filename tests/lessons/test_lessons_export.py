"""Exported scripts run as separate programs and repeat a live run bitwise."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from lessons.events import Appear, Event, InsertTask, MoveLevel, MoveTarget, Push, Release, Reset, Set
from lessons.replay.script import script
from lessons.scenes.catalog import prepared
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import TorqueScene, VelocityScene
from lessons.session.torque import TorqueSession
from lessons.session.velocity import VelocitySession

ROOT = Path(__file__).parents[2]
Events = Sequence[tuple[float, Event]]


def live(state: RunSpec, events: Events, seconds: float) -> tuple[Any, dict[str, np.ndarray]]:
    """Runs a session through its mailbox, as the page does. Returns the session and its rows since the
    reset."""
    scene = state.prepared()
    session: Any
    if isinstance(scene, TorqueScene):
        session = TorqueSession(scene, state.seed)
    else:
        assert isinstance(scene, VelocityScene)
        session = VelocitySession(scene, state.seed)
    waiting = list(events)
    rows: list[np.ndarray] = []
    ran = 0.0
    while ran < seconds - 1e-9:
        while waiting and waiting[0][0] <= ran + 1e-9:
            session.post(waiting.pop(0)[1])
        before = session.t
        # While the session is paused, events take effect before the next tick.
        session.drain()
        rows = [] if session.t < before else rows
        before = session.t
        rows.append(session.tick().copy())
        ran += session.t - before
    fields = session.layout.fields
    table = np.array(rows)
    return session, {name: table[:, fields[name]] for name in ("t", "q", "v", "tau", "tau_demand")}


def repeated(text: str, folder: Path) -> dict[str, np.ndarray]:
    """Runs the script as a separate program and returns the data that it saves."""
    path, out = folder / "run.py", folder / "run.npz"
    path.write_text(text)
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    done = subprocess.run(
        [sys.executable, str(path), str(out)],
        cwd=folder,
        env=environment,
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert '"diverged": false' in done.stdout
    return dict(np.load(out))


TORQUE: Events = (
    (0.0, Set("horizon", 4)),
    (0.02, MoveTarget("position", (0.62, 0.25))),
    (0.05, Set("controller", "tdeosf")),
    (0.08, MoveLevel("posture", 0)),
    (0.08, Push("link_2", force=(0.0, 5.0, 0.0), seconds=0.03)),
    (0.10, Set("plant.payload_kg", 0.5)),
    (0.12, Set("deadline_ms", 0.3)),
    (0.15, Reset()),
    (0.20, MoveTarget("position", (0.6, 0.2))),
    (0.201, MoveTarget("position", (0.55, 0.22))),
    (0.25, Set("controller", "himpc")),
    (0.26, Set("T_s", 0.002)),
    (0.30, MoveLevel("posture", 2)),
    (0.34, Set("levels.orientation.enabled", False)),
    (0.36, Push("link_3", torque=(0.0, 0.0, 0.4), seconds=0.02)),
    (0.40, MoveTarget("posture", (0.1, 0.2, 0.3))),
)

MOBILE: Events = (
    (0.3, Set("plant.position_noise", 1e-4)),
    (0.5, MoveTarget("base", (0.5, 0.2))),
    (0.8, Appear("ball", (2.5, 0.5, 0.8), 0.2)),
    (1.0, Set("formulation", "paper")),
    (1.5, Reset()),
    (2.0, MoveTarget("ee", (1.7, 0.3, 0.8))),
    (2.2, MoveLevel("base", 0)),
    (2.4, Set("delta_m", 0.02)),
    (2.6, InsertTask("more", "base", (0.4, -0.3), cruise=0.4)),
    (2.8, Release("ee")),
    (3.0, Appear("ball", (2.4, 0.4, 0.8), 0.25)),
    (3.2, MoveTarget("base", (0.2, -0.2))),
)


@pytest.mark.parametrize(
    ("state", "events", "seconds"),
    [
        (RunSpec("planar3-hold", set=("M_bar_scale=1.1",)), TORQUE, 0.5),
        (RunSpec("ridgeback-ur10-drag", set=("plant.mode=servo",), seed=3), MOBILE, 4.0),
    ],
    ids=["torque", "mobile"],
)
def test_a_script_repeats_the_run_to_the_last_bit(
    state: RunSpec, events: Events, seconds: float, tmp_path: Path
) -> None:
    """The run contains drags, pushes, level moves, settings and a reset; the script gives the same rows after
    the reset."""
    session, rows = live(state, events, seconds)
    assert session.notices == []
    assert len(session.log) == len(events)
    text = script(state, session.log, session.t)
    assert "Reset" not in text
    saved = repeated(text, tmp_path)
    np.testing.assert_array_equal(saved["t"], rows["t"][:, 0])
    for name in ("q", "v", "tau", "tau_demand"):
        np.testing.assert_array_equal(saved[name], rows[name])
    assert np.abs(np.diff(rows["q"], axis=0)).max() > 1e-4


def test_a_script_is_short_and_reads_like_one(tmp_path: Path) -> None:
    """The script of an unchanged run has thirty lines, and each setting or drag adds one line."""
    state = RunSpec("planar3-hold", set=("horizon=7",))
    plain = script(state, (), 0.5)
    assert len(plain.splitlines()) <= 30
    assert "SETTINGS = (\n    'horizon=7',\n)" in plain
    dragged = script(state, [(0.1, MoveTarget("position", (np.float64(0.6), 0.2)))], 0.5)  # pyright: ignore
    assert len(dragged.splitlines()) <= len(plain.splitlines()) + 4
    assert "(0.1, MoveTarget('position', (0.6, 0.2)))," in dragged
    compile(dragged, "run.py", "exec")


def test_settings_before_a_reset_become_settings_of_the_script() -> None:
    """Events that a reset undoes are omitted; each lasting change is among the settings once."""
    log: Events = [
        (0.1, Set("horizon", 9)),
        (0.2, Set("horizon", 8)),
        (0.3, MoveTarget("position", (0.6, 0.2))),
        (0.4, MoveLevel("posture", 0)),
        (0.0, Reset()),
        (0.1, Set("horizon", 3)),
    ]
    text = script(RunSpec("planar3-hold"), log, 0.2)
    settings = text[text.index("SETTINGS") : text.index("EVENTS")]
    assert settings.count("'") == 4
    assert "'horizon=8'" in settings
    assert "order=posture,position,orientation" in settings
    assert "MoveTarget" not in text
    assert "(0.1, Set('horizon', 3))," in text
    assert "since the last reset" in text


def test_a_script_of_measured_deadlines_says_that_it_cannot_repeat() -> None:
    measured = [(0.1, Set("solve_ms_per_knot", 0.0)), (0.2, Set("deadline_ms", 1.0))]
    assert "Measured computing times" in script(RunSpec("planar3-hold"), measured, 0.5)
    assert "Measured computing times" not in script(RunSpec("planar3-hold"), measured[:1], 0.5)


def test_a_robot_from_a_file_and_its_tip_are_named(tmp_path: Path) -> None:
    state = RunSpec("hold", urdf="planar3", tip="link_2")
    assert "load_scene('hold', 'planar3', 'link_2')" in script(state, (), 0.1)
    assert prepared(state.loaded(), None, ()).robot.tip == "link_2"
