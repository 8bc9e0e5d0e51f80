"""The example controllers of the package agree with the lab's own controllers to 1e-6 N·m."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import lessons.examples
from himpc import printed
from lessons.events import MoveTarget, Push
from lessons.recording.run import run
from lessons.scenes.catalog import load_scene, prepared, torque_scene
from lessons.scenes.run_spec import AS_PRINTED
from lessons.session.controllers import controller_of
from lessons.session.torque import TorqueSession

FOLDER = Path(next(iter(lessons.examples.__path__)))


def beside(session: TorqueSession, name: str, ticks: int) -> float:
    """Returns the largest difference in torque, N·m, between the controller of a session and an example that
    receives the same states."""
    settings = prepared(session.scene, str(FOLDER / name), ()).settings
    example = controller_of(settings, session.robot)
    example.reset(session.plant.tau)
    worst = 0.0
    for _ in range(ticks):
        session.drain()
        state, T_s, N = session.plant.measure(session.settings.T_s), settings.T_s, settings.horizon
        previews = {
            task: reference.preview(session.t, T_s, N) for task, reference in session.references.items()
        }
        answer = example.step(state.q, state.v, previews, session.plant.tau)
        assert answer.notice is None
        session.tick()
        assert session.plan is not None
        worst = max(worst, float(np.abs(answer.tau - session.plan.tau).max()))
    return worst


@pytest.mark.parametrize(
    ("scene", "ticks"),
    [
        ("iiwa14-hold", 1000),
        pytest.param("planar3-conflict", 2500, marks=pytest.mark.nightly("himpc/")),
        pytest.param("iiwa14-circle", 1000, marks=pytest.mark.nightly("himpc/")),
    ],
)
def test_own_himpc_on_one_page_agrees_with_the_lab(scene: str, ticks: int) -> None:
    """The example agrees also with active bounds, a target that jumps and a push."""
    session = TorqueSession(prepared(torque_scene(scene), None, AS_PRINTED))
    if scene == "iiwa14-hold":
        position = session.references["position"].preview(0.0, 1e-3, 1).value
        session.post(MoveTarget("position", tuple(position + np.array([0.2, -0.2, -0.1]))))
        session.post(Push("iiwa_link_5", (20.0, 5.0, 0.0)))
    assert beside(session, printed.__file__, ticks) < 1e-9


def test_own_himpc_is_one_page() -> None:
    assert len(Path(printed.__file__).read_text().splitlines()) < 260


@pytest.mark.parametrize(
    ("name", "set"), [("osf", ("controller=osf",)), ("one_level_qp", ("controller=weighted", "horizon=1"))]
)
def test_own_example_is_what_the_lab_has(name: str, set: tuple[str, ...]) -> None:
    session = TorqueSession(prepared(torque_scene("planar3-circle"), None, set))
    assert beside(session, f"{name}.py", 1000) < 1e-6


def test_own_pd_holds_an_arm() -> None:
    recording = run(prepared(load_scene("planar3-hold"), str(FOLDER / "pd.py"), ()), 2.0)
    assert np.abs(recording["error/position"][-1]).max() < 0.02
