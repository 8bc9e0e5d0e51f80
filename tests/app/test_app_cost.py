"""The amount of data that a page receives: only visible charts, few points per curve, no more than the client
reads, and as often as something moves."""

from __future__ import annotations

import time
from collections.abc import Iterator

import numpy as np
import pytest
from served import LONG, served, vacated
from viser import ClientHandle

from app.adapter import private
from app.client.recording import decimate
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.process import wait_until
from app.page.page import CALM, LEAST, PLOTS, POSES, STILL, TEXTS, Cadence
from app.panels.widgets.chart import _TOP, _axis
from app.web.server import PageServer
from browsing.viewer import Second, Viewer
from lessons.scenes.run_spec import RunSpec

TORQUE, NEAREST = "Torque, % of bound", "Joint nearest its bound, %"


@pytest.fixture(scope="module")
def circling() -> Iterator[PageServer]:
    with served("planar3-circle", grace=0.0) as running:
        yield running


@pytest.fixture
def alone(circling: PageServer) -> PageServer:
    return vacated(circling)


def test_only_charts_in_view_are_sent(alone: PageServer) -> None:
    with Viewer(alone.link) as viewer:
        assert wait_until(lambda: TORQUE in viewer.drawn and bool(viewer.second.links), LONG)
        for tab, seen, unseen in (("Errors", NEAREST, TORQUE), ("Joints", TORQUE, NEAREST)):
            viewer.tab = tab
            viewer.second = Second()
            # wait until data that were sent earlier have arrived
            assert wait_until(lambda seen=seen: seen in viewer.drawn, LONG)
            viewer.second = Second()
            assert wait_until(lambda: max(viewer.second.plots.values(), default=0) >= 5, LONG)
            assert seen in viewer.drawn and unseen not in viewer.drawn


def test_a_page_that_nobody_sees_gets_no_pictures(alone: PageServer) -> None:
    with Viewer(alone.link) as viewer:
        assert wait_until(lambda: viewer.moves, LONG)
        viewer.tab = None
        (shown,) = (each._page for each in alone._visits.values() if each._page is not None)
        assert wait_until(lambda: shown._scene is not None and shown._scene.page.in_view.asleep, LONG)
        for _ in range(2):  # the last updates may still arrive in the first second
            viewer.second = Second()
            assert wait_until(lambda: viewer.second.messages >= 30, LONG)
        assert not viewer.second.plots and not viewer.second.links
        viewer.tab = "Joints"
        assert wait_until(lambda: viewer.moves, LONG)


def test_a_slow_line_gets_fewer_pictures_not_a_queue(alone: PageServer) -> None:
    with Viewer(alone.link, slow=True) as viewer:
        assert wait_until(lambda: viewer.moves, LONG)
        (client,) = alone._viser.get_clients().values()
        (learner,) = alone.sessions.learners
        viewer.reads.clear()  # written data stay in the buffers
        assert wait_until(lambda: private.waiting(client) > 0, LONG)
        status = learner.status
        assert status is not None
        waits = private.waiting(client)
        assert wait_until(lambda: learner.status is not None and learner.status.t > status.t + 2.0, LONG)
        assert private.waiting(client) < waits + 100  # each text replaces its previous one
        # When the client reads again, updates arrive again.
        viewer.second = Second()
        viewer.reads.set()
        assert wait_until(lambda: private.waiting(client) == 0, LONG)
        assert wait_until(lambda: viewer.moves, LONG)


def test_a_slow_line_queues_one_scene_at_most(alone: PageServer) -> None:
    """While a connection delivers nothing, the page does not build further scenes; afterwards it builds the
    last one."""
    with Viewer(alone.link, slow=True) as viewer:
        assert wait_until(lambda: viewer.moves, LONG)
        (client,) = alone._viser.get_clients().values()
        (learner,) = alone.sessions.learners
        (shown,) = (each._page for each in alone._visits.values() if each._page is not None)
        assert wait_until(lambda: private.waiting(client) > 0, LONG)
        viewer.reads.clear()
        queued = []
        for scene in ("planar3-hold", "planar3-singular", "planar3-conflict"):
            learner.load(SceneChoice(RunSpec(scene)))
            assert wait_until(lambda scene=scene: simulates(learner, scene), LONG)
            assert wait_until(lambda: is_steady(client), LONG)  # a scene may still be built
            queued.append(private.waiting(client))
        assert queued[-1] < queued[0] + 100
        viewer.reads.set()
        assert wait_until(lambda: shown._built is learner.ready and private.waiting(client) == 0, LONG)


def is_steady(client: ClientHandle) -> bool:
    """Returns whether no messages of a scene are queued within half a second."""
    before = private.waiting(client)
    time.sleep(0.5)
    return private.waiting(client) < before + 20


def simulates(learner: SimulationClient, scene: str) -> bool:
    """Returns whether a scene has run for half a second."""
    status = learner.status
    return learner.choice.run.scene == scene and status is not None and status.t > 0.5


def test_corners_show_the_curves() -> None:
    rng = np.random.default_rng(5)
    x = np.arange(320)
    curves = np.array([np.sin(x / 40), 0.02 * rng.standard_normal(320), np.zeros(320)])
    curves[2, 170] = 1.0  # a spike
    for phase in (0, 7, -123):
        kept = decimate(curves, 0.05, phase)
        drawn = np.array([np.interp(x, kept, curve[kept]) for curve in curves])
        assert np.abs(drawn - curves).max() <= 0.1 and drawn[2, 170] == 1.0
        assert kept[0] == 0 and kept[-1] == 319 and len(kept) < 200
    assert decimate(np.ones((2, 320)), 1e-9).tolist() == [0, 319]


def test_curves_that_slide_past_keep_their_corners() -> None:
    """A curve that moves along the axis keeps the same points, because it would flicker otherwise."""
    x = np.arange(400)
    curve = np.sin(x / 25)[None]
    now, then = (
        set((start + decimate(curve[:, start : start + 320], 0.01, start)).tolist()) for start in (20, 26)
    )
    inside = set(range(64, 300))
    assert now & inside == then & inside


def test_axes_have_a_few_round_ticks() -> None:
    axis = _axis((-120.0, 120.0), log=False)
    assert list(axis["values"]) == ["-100", "-50", "0", "50", "100"]  # pyright: ignore
    assert np.allclose(axis["splits"], _TOP * (np.array([-100, -50, 0, 50, 100]) + 120) / 240)  # pyright: ignore
    assert _axis((-3.0, 3.0), log=True)["values"][0] == "0.001"  # pyright: ignore


def looks(cadence: Cadence, begin: float, end: float, moves: bool, pace: float) -> tuple[float, float, float]:
    """Returns the numbers of looks, plots and texts per second."""
    now, seen = begin, [0, 0, 0]
    while now < end:
        seen[0] += 1
        seen[1] += cadence.plots_due(now)
        seen[2] += cadence.texts_due(now)
        now += cadence.shown(now if moves else "here", pace, now)
    return seen[0] / (end - begin), seen[1] / (end - begin), seen[2] / (end - begin)


def test_a_page_is_updated_as_often_as_something_moves() -> None:
    cadence = Cadence()
    fast = looks(cadence, 0.0, 10.0, moves=True, pace=1.0)
    assert abs(fast[0] - POSES) < 0.5 and abs(fast[1] - PLOTS) < 0.5 and abs(fast[2] - TEXTS) < 0.5
    slowed = looks(cadence, 10.0, 20.0, moves=True, pace=0.1)
    assert abs(slowed[0] - LEAST * POSES) < 0.5 and abs(slowed[1] - LEAST * PLOTS) < 0.5
    assert slowed[2] > 0.8 * TEXTS, "texts come as soon in slowed time"
    looks(cadence, 20.0, 20.0 + 2 * STILL, moves=False, pace=1.0)
    still = looks(cadence, 30.0, 40.0, moves=False, pace=1.0)
    assert all(abs(rate - CALM) < 0.5 for rate in still)
    again = looks(cadence, 40.0, 50.0, moves=True, pace=1.0)
    assert abs(again[0] - POSES) < 0.5, "and as soon as it moves, as often as before"
