"""A user changes the hierarchy in a real browser while the robot moves."""

from __future__ import annotations

from playwright.sync_api import Page, expect
from served import error, latest

from app.client.simulation_client import SimulationClient
from app.web.server import PageServer
from browsing.browser_actions import (
    BETWEEN,
    click_on,
    drag_target,
    eventually,
    is_drawn,
    key,
    pick,
    press,
    row,
    tab,
    target_position,
    unfold,
    write,
)
from browsing.wire import Wire
from himpc.tasks.axes import OnAxes
from lessons.settings.torque import TorqueSettings

ELBOW = "/targets/elbow/control/mark"


def settings(learner: SimulationClient) -> TorqueSettings:
    assert isinstance(learner.settings, TorqueSettings)
    return learner.settings


def levels(learner: SimulationClient) -> list[str]:
    return [level.name for level in settings(learner).levels]


def frame_clicked(page: Page) -> str:
    """Returns the frame that the menu shows after a click on the forearm."""
    click_on(page, "/robot/4/shape8")
    return row(page, "Of frame").locator("input").first.input_value()


def test_a_task_is_added_dragged_moved_reduced_merged_passed_on_and_removed(
    page: Page, server: PageServer
) -> None:
    """A user adds an elbow task below the hand. Errors, ranks and gizmo show every change, no level loses its
    target, and the code of the stack gives the same stack elsewhere."""
    learner = server.sessions.learners[0]
    tab(page, "Tasks")
    unfold(page, "Add a task")
    box = row(page, "Click a link").get_by_role("checkbox")
    box.click()
    expect(box).to_be_checked()  # the page may draw the tick a moment after the click
    assert eventually(page, lambda: frame_clicked(page) == "link_4")
    pick(page, "On level", "a level of its own, at place 2")
    write(page, "Its name", "elbow")
    press(page, "Add")
    assert eventually(page, lambda: levels(learner) == ["position", "elbow", "orientation", "posture"])
    assert eventually(page, lambda: is_drawn(page, "/targets/elbow/control"))
    expect(page.get_by_text("2/3 free", exact=False).first).to_be_visible()
    assert error(learner, "position") < 1e-3
    key(page, "4")  # before, this key belonged to no level
    assert eventually(page, lambda: not settings(learner).levels[3].enabled)
    key(page, "9")
    key(page, "4")
    assert eventually(page, lambda: settings(learner).levels[3].enabled)
    expect(page.get_by_text("elbow [mm]", exact=True).first).to_be_visible()  # the curve of the new task

    before = target_position(page, ELBOW)
    drag_target(page, axis=0, along=0.08, node="/targets/elbow/control", arm=0.13)
    assert eventually(page, lambda: target_position(page, ELBOW)[0] > before[0] + 0.03)
    assert eventually(page, lambda: error(learner, "elbow") > 1e-3)
    assert eventually(page, lambda: error(learner, "position") < 2e-3)
    assert (
        abs(latest(learner, "priority_leak")[0]) < 1e-6
    )  # the elbow's level does not disturb the level above

    strip = page.locator("[data-dock-group]", has=page.get_by_text("Levels", exact=True))
    strip.get_by_text("Levels", exact=True).click()
    row(page, "elbow").get_by_role("button", name="▲", exact=True).click()  # over the scene
    assert eventually(page, lambda: levels(learner)[:2] == ["elbow", "position"])
    expect(page.get_by_text("1 · elbow", exact=True)).to_have_count(2)
    strip.locator("[data-dock-minimize]").click()
    open_level(page, 0)
    unfold(page, "Change")
    pick(page, "Axes", "x")
    assert eventually(page, lambda: axes(learner, "elbow") == "x")
    expect(page.get_by_text("1/1 free", exact=False).first).to_be_visible()
    assert eventually(page, lambda: error(learner, "elbow") < 2e-3)

    expect(row(page, "Axes").locator("input").first).to_be_visible()  # the task stays unfolded
    open_level(page, 1)
    unfold(page, "Change", 1)
    page.get_by_role("button", name="Merge with the level above", exact=True).first.click()
    assert eventually(page, lambda: levels(learner) == ["elbow+position", "orientation", "posture"])
    expect(page.get_by_text("4/4 free", exact=False).first).to_be_visible()
    assert eventually(page, lambda: error(learner, "position") < 2e-3)

    open_level(page, 0)
    unfold(page, "Change")
    press(page, "Own level for elbow")
    assert eventually(page, lambda: levels(learner) == ["position", "elbow", "orientation", "posture"])
    expect(page.get_by_text("2 · elbow", exact=True)).to_be_visible()
    flex = 'ancestor::div[contains(@class,"mantine-Flex-root")][1]'
    named = page.locator(f'xpath=//label[normalize-space(.)="Name"]/{flex}//input')
    name = named.locator("visible=true").first
    name.fill("forearm")
    name.press("Tab")
    page.wait_for_timeout(BETWEEN)
    press(page, "Rename")
    assert eventually(page, lambda: levels(learner) == ["position", "forearm", "orientation", "posture"])
    expect(page.get_by_text("2 · forearm", exact=True)).to_be_visible()
    assert eventually(page, lambda: is_drawn(page, "/targets/forearm/control"))
    assert axes(learner, "forearm") == "x"
    assert eventually(page, lambda: error(learner, "position") < 2e-3)

    tab(page, "More")
    tab(page, "Export")
    press(page, "Write it down")
    code = row(page, "Code").locator("textarea").input_value()
    with Wire(server.link) as elsewhere:
        assert eventually(page, lambda: elsewhere.find("Somebody's code") is not None)
        elsewhere.use("Somebody's code", code)
        elsewhere.use("Open it")
        other = server.sessions.learners[1]
        assert eventually(page, lambda: other.settings == settings(learner)), elsewhere.notices

    tab(page, "Tasks")  # the task that was edited last is unfolded
    press(page, "Remove forearm")
    assert eventually(page, lambda: levels(learner) == ["position", "orientation", "posture"])
    assert eventually(page, lambda: not is_drawn(page, "/targets/forearm/control"))
    assert learner.failure is None
    status = learner.status
    assert status is not None
    assert eventually(page, lambda: learner.status is not None and learner.status.t > status.t + 0.1)
    assert eventually(page, lambda: error(learner, "position") < 2e-3)


def open_level(page: Page, place: int) -> None:
    """Opens the settings of a level, by its index."""
    page.get_by_role("button", name="⋯", exact=True).nth(place).click()
    page.wait_for_timeout(BETWEEN)


def axes(learner: SimulationClient, name: str) -> str:
    tasks = (task for level in settings(learner).levels for task in level.tasks if task.name == name)
    found = next(tasks)
    assert isinstance(found, OnAxes)
    return found.axes
