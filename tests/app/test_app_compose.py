"""Changes of the hierarchy by a page's controls, without a browser: the simulation applies them."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from served import served

from app.link.choice import SceneChoice
from app.link.messages import Post
from app.link.process import wait_until
from app.web.server import PageServer
from browsing.wire import Wire
from himpc.catalog import CONTROLLERS
from lessons.events import MoveTarget, Reset
from lessons.scenes.run_spec import RunSpec

LONG = 60.0


@pytest.fixture
def server() -> Iterator[PageServer]:
    with served("iiwa14-hold", grace=2.0) as running:
        yield running


def shown(wire: Wire, label: str) -> str:
    """Returns the id of the control with this label, as soon as it exists."""
    assert wait_until(lambda: wire.find(label) is not None, LONG), label
    return str(wire.find(label))


def test_where_a_posture_wants_the_joints_is_set_by_sliders(server: PageServer) -> None:
    """Each joint has a slider in degrees within its limits. Sliders that are moved at the same time do not
    overwrite each other, and a reset restores them."""
    with Wire(server.link) as wire:
        assert wait_until(lambda: bool(server.sessions.learners), 60.0)
        learner = server.sessions.learners[0]

        def target() -> np.ndarray:
            status = learner.status
            return np.zeros(7) if status is None else np.degrees(status.targets["posture"])

        first, second = (shown(wire, f"joint {number}, °") for number in (1, 2))
        assert [wire.controls[first]["props"][end] for end in ("min", "max")] == [-170.0, 170.0]
        assert wait_until(lambda: learner.status is not None, LONG)
        before = target()
        assert wire.controls[second]["value"] == pytest.approx(before[1], abs=0.051)
        wire.write(first, value=20.0)
        wire.write(second, value=15.5)
        assert wait_until(lambda: np.allclose(target()[:2], [20.0, 15.5]), LONG)
        assert np.allclose(target()[2:], before[2:])
        told = learner.ask()
        assert told is not None
        assert [event.task for _, event in told.log if isinstance(event, MoveTarget)] == ["posture"] * 2
        learner.send(Post(Reset()))
        assert wait_until(lambda: np.allclose(target(), before), LONG)
        assert wait_until(lambda: wire.controls[first]["value"] == pytest.approx(before[0], abs=0.051), LONG)
        assert wire.find("x, °") is None and wire.notices == []


def test_where_a_posture_wants_what_slides_is_set_in_metres() -> None:
    """The slider of a base joint without limits has a range of 2 m to each side."""
    run = RunSpec("ridgeback-ur10-hold", set=('stack.add={"task": "posture"}',))
    with served(SceneChoice(run), grace=2.0) as server, Wire(server.link) as wire:
        slider = shown(wire, "base_x, m")
        assert [wire.controls[slider]["props"][end] for end in ("min", "max")] == [-2.0, 2.0]
        learner = server.sessions.learners[0]
        assert wait_until(lambda: learner.status is not None, LONG)
        wire.write(slider, value=0.3)

        def wanted() -> float:
            return 0.0 if learner.status is None else float(learner.status.targets["posture"][0])

        assert wait_until(lambda: wanted() == pytest.approx(0.3), LONG)
        assert wire.notices == []


def test_the_menu_switches_the_controller(server: PageServer) -> None:
    """The menu offers every registered name, and the page describes the chosen one."""
    with Wire(server.link) as wire:
        menu = shown(wire, "Controller")
        assert list(wire.controls[menu]["props"]["options"]) == list(CONTROLLERS)
        learner = server.sessions.learners[0]
        for name in ("hqp", "himpc"):
            wire.write(menu, value=name)
            assert wait_until(lambda name=name: getattr(learner.settings, "controller", "") == name, LONG)
            assert wait_until(lambda name=name: wire.shows(CONTROLLERS[name]), LONG)
