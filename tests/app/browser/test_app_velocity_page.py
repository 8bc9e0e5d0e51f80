"""The mobile manipulator's scenes in a real browser."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from served import error, latest, served

from app.client.simulation_client import SimulationClient
from app.link.messages import MissionView, Post
from app.web.server import PageServer
from browsing.browser_actions import (
    drag_target,
    eventually,
    is_drawn,
    open_page,
    pick,
    position,
    press,
    row,
    set_number,
    tab,
    target_position,
    unfold,
    wait_for_scene,
)
from browsing.scene_switch import reset_all
from lessons.events import Set
from lessons.scenes.names import ALL_SCENES
from lessons.settings.velocity import VelocitySettings
from robots.collision import Ball, Box, Floor

MISSIONS = pytest.mark.nightly(
    *(f"app/{part}" for part in ("adapter", "html", "link", "page", "panels", "view", "worker")),
    *("browsing/", "himpc/htmpc", "himpc/missions", "lessons/scenes", "lessons/session", "lessons/settings"),
)


@pytest.fixture(scope="module")
def server() -> Iterator[PageServer]:
    with served("ridgeback-ur10-drag", grace=2.0) as running:
        yield running


@pytest.fixture(scope="module")
def shared_page(browser: Browser, server: PageServer) -> Iterator[Page]:
    opened = open_page(browser, server.link, width=1400, height=700)
    yield opened
    opened.context.close()


@pytest.fixture
def page(shared_page: Page, server: PageServer) -> Page:
    """Returns the page after a reset, in the same state for each test."""
    assert eventually(shared_page, lambda: bool(server.sessions.learners))
    tab(shared_page, "Learn")
    reset_all(shared_page, server.sessions.learners[0])
    return shared_page


@pytest.fixture
def learner(server: PageServer, page: Page) -> SimulationClient:
    """Returns the simulation of `page`, which was reset before."""
    found = server.sessions.learners[0]
    assert eventually(page, lambda: found.status is not None and found.status.ticks > 0)
    return found


def mission(learner: SimulationClient) -> MissionView:
    assert learner.status is not None and learner.status.mission is not None
    return learner.status.mission


def goal(learner: SimulationClient, place: int) -> np.ndarray:
    """Returns the goal of the task with this index in the mission, m."""
    found = mission(learner).rows[place].goal
    assert found is not None
    return np.array(found)


def at_rest(learner: SimulationClient) -> bool:
    return bool(np.abs(latest(learner, "v")).max() < 0.02)


def load(page: Page, learner: SimulationClient, scene: str) -> None:
    """Loads a scene by the menu of the Robot tab, if it is not loaded yet."""
    if learner.ready is not None and learner.ready.choice.run.scene == scene:
        return
    tab(page, "Robot")
    pick(page, "Scene", scene)
    expect(page.get_by_text(ALL_SCENES[scene])).to_be_visible()
    press(page, "Load scene")
    assert eventually(page, lambda: learner.ready is not None and learner.ready.choice.run.scene == scene)
    assert eventually(page, lambda: learner.status is not None and learner.status.mission is not None)
    wait_for_scene(page, "/goal/base")


def test_the_base_stops_out_of_reach_and_goes_when_it_comes_first(
    page: Page, learner: SimulationClient
) -> None:
    load(page, learner, "ridgeback-ur10-drag")
    expect(page.get_by_text("Drag the two targets by their arrows")).to_be_visible()
    for _ in range(2):
        drag_target(page, axis=1, along=-1.0, node="/goal/base", arm=0.5)

    def wanted() -> np.ndarray:
        assert learner.status is not None
        return np.array(learner.status.targets["base"])

    assert eventually(page, lambda: bool(np.linalg.norm(wanted() - latest(learner, "x/ee")[:2]) > 2.2))
    worst = 0.0

    def stopped() -> bool:
        nonlocal worst
        worst = max(worst, error(learner, "ee"))
        return bool(latest(learner, "x/base")[1] < -0.3) and at_rest(learner)

    assert eventually(page, stopped)
    assert worst < 0.01 and error(learner, "base") > 0.3
    expect(page.get_by_text("It rests: any further motion would disturb level 1")).to_be_visible()
    expect(page.get_by_text("Now swap which task comes first")).to_be_visible()
    press(page, "Swap which comes first")
    assert eventually(page, lambda: error(learner, "base") < 0.01)
    assert [each.name for each in mission(learner).rows] == ["base", "ee"]
    assert error(learner, "ee") > 0.2


def test_a_mission_runs_to_its_end_though_a_task_is_moved_meanwhile(
    page: Page, learner: SimulationClient
) -> None:
    load(page, learner, "ridgeback-ur10-cluttered")
    assert eventually(page, lambda: is_drawn(page, "/obstacle/1"))
    before = goal(learner, 1)
    # The mission takes six seconds; on a busy machine it would end before the drag begins, so it runs slowly.
    set_number(page, "Speed", 0.1)
    assert eventually(page, lambda: learner.status is not None and learner.status.speed == 0.1)
    press(page, "Reset")
    tab(page, "Tasks")
    expect(page.get_by_text("0 of 2 done")).to_be_visible()
    drag_target(page, axis=1, along=-0.5, node="/goal/base", arm=0.5)

    def arrived() -> bool:
        """Returns whether all moves of the drag have been applied, that is, whether the task's goal is at the
        position of the disc. A drag consists of many moves, and a tick takes a second here."""
        left = target_position(page, "/goal/base/disc")[:2]
        return left[1] < before[1] - 0.2 and np.allclose(goal(learner, 1), left, atol=1e-3)

    assert eventually(page, arrived)
    assert not mission(learner).done
    set_number(page, "Speed", 8)
    expect(page.get_by_text("MISSION DONE").last).to_be_visible()
    assert np.linalg.norm(latest(learner, "x/base") - goal(learner, 1)) < 0.05
    assert latest(learner, "clearance")[0] > 0.0


@MISSIONS
def test_obstacles_are_moved_by_hand_and_put_in_the_way(page: Page, learner: SimulationClient) -> None:
    load(page, learner, "ridgeback-ur10-cluttered")
    assert eventually(page, lambda: is_drawn(page, "/obstacle_arrows/1"))

    def obstacles() -> dict[str, Ball | Box]:
        settings = learner.settings
        assert isinstance(settings, VelocitySettings)
        return {each.name: each for each in settings.htmpc.obstacles if not isinstance(each, Floor)}

    before = obstacles()
    place = sorted(before).index("table")
    press(page, "Pause")
    press(page, "Look at the robot")
    drag_target(page, axis=1, along=0.5, node=f"/obstacle_arrows/{place}", arm=0.6)
    assert eventually(page, lambda: obstacles()["table"].centre[1] > before["table"].centre[1] + 0.2)
    assert eventually(
        page,
        lambda: np.allclose(
            position(page, f"/obstacle/{place}"), obstacles()["table"].centre, rtol=0.0, atol=1e-3
        ),
    )
    assert replace(obstacles()["table"], centre=before["table"].centre) == before["table"]
    press(page, "Put an obstacle in the way")
    assert eventually(page, lambda: len(obstacles()) == len(before) + 1)
    press(page, "Take the last ball away")
    assert eventually(page, lambda: len(obstacles()) == len(before))
    press(page, "Put an obstacle in the way")
    assert eventually(page, lambda: len(obstacles()) == len(before) + 1)
    unfold(page, "Show")
    row(page, "Arrows of obstacles").locator("input").click()
    assert eventually(page, lambda: not is_drawn(page, f"/obstacle_arrows/{place}"))
    tab(page, "Learn")
    reset_all(page, learner)
    assert eventually(page, lambda: obstacles() == before)


@MISSIONS
def test_a_crate_is_outlined_where_it_is_reported(page: Page, learner: SimulationClient) -> None:
    """The outline is drawn while the report is wrong; the solid crate stays where it is."""
    load(page, learner, "ridgeback-ur10-perception")
    learner.send(Post(Set("report_end", 1000.0)))
    press(page, "Reset")
    assert eventually(page, lambda: is_drawn(page, "/reported/0"))
    for node, place in {"/reported/0": (1.9, 0.3, 0.25), "/obstacle/0": (1.9, 1.4, 0.25)}.items():
        assert eventually(page, lambda at=place, of=node: np.allclose(position(page, of), at, atol=1e-6))
    tab(page, "Tasks")
    row(page, "Reported wrongly").locator("input").click()
    assert eventually(page, lambda: not is_drawn(page, "/reported/0"))
    assert eventually(page, lambda: latest(learner, "clearance") == latest(learner, "clearance_reported"))
