"""A robot with one moving joint in a real browser: it holds its position, follows a dragged target and
resets."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
from playwright.sync_api import Browser, Page
from served import served

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.web.server import PageServer
from browsing.browser_actions import drag_target, eventually, open_page, target_position
from browsing.scene_switch import reset_all, show_scene
from lessons.scenes.run_spec import RunSpec

pytestmark = pytest.mark.usefixtures("one_fork_server")

ONE_JOINT = """<robot name="one"><link name="base"/><link name="arm"><inertial><origin xyz="0.1 0 0"/>
<mass value="1"/><inertia ixx="0.01" iyy="0.02" izz="0.02" ixy="0" ixz="0" iyz="0"/></inertial></link>
<link name="tool"/><joint name="j" type="{kind}"><parent link="base"/><child link="arm"/><axis xyz="{axis}"/>
<limit lower="-1" upper="1" velocity="3" effort="50"/></joint><joint name="t" type="fixed">
<parent link="arm"/><child link="tool"/><origin xyz="0.3 0 0"/></joint></robot>"""
ALONG = 0.15  # m, along y


def one(kind: str, axis: str) -> SceneChoice:
    return SceneChoice(RunSpec("hold"), urdf_text=ONE_JOINT.format(kind=kind, axis=axis))


def joint(learner: SimulationClient) -> float:
    found = learner.read(lambda _, history: float(history.latest[history.layout.fields["q"]][0]))
    assert found is not None
    return found


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with served(one("revolute", "0 0 1")) as running:
        yield running


@pytest.fixture(scope="module")
def page(browser: Browser, server: PageServer) -> Iterator[Page]:
    opened = open_page(browser, server.link)
    yield opened
    opened.context.close()


@pytest.mark.parametrize(
    ("kind", "axis", "there"),
    [("revolute", "0 0 1", np.arctan2(ALONG, 0.3)), ("prismatic", "0 1 0", ALONG)],
    ids=["revolute", "prismatic"],
)
def test_one_joint_holds_is_dragged_and_runs(
    page: Page, server: PageServer, kind: str, axis: str, there: float
) -> None:
    """A revolute joint moves to the point nearest to the dragged target, a prismatic joint to the target
    itself."""
    learner = server.sessions.learners[0]
    show_scene(page, learner, one(kind, axis))
    assert eventually(page, lambda: learner.status is not None and learner.status.t > 1.0)
    home = joint(learner)
    assert abs(home) < 1e-3
    before = np.array(target_position(page))
    drag_target(page, axis=1, along=ALONG, arm=0.042)
    moved = np.array(target_position(page)) - before
    assert moved[1] == pytest.approx(ALONG, abs=0.02) and np.abs(moved[[0, 2]]).max() < 0.02
    there *= float(moved[1]) / ALONG  # a drag in the browser is not exact
    assert eventually(page, lambda: abs(joint(learner) - there) < 0.02), joint(learner)
    reset_all(page, learner)
    assert eventually(page, lambda: abs(joint(learner) - home) < 0.01)
    ticks = 0 if learner.status is None else learner.status.ticks
    assert eventually(page, lambda: learner.status is not None and learner.status.ticks > ticks + 100)
    assert learner.trouble() is None
