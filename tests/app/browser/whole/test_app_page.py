"""The page in a real browser."""

from __future__ import annotations

import os
import re
import signal
from pathlib import Path

import numpy as np
import pytest
from playwright.sync_api import Browser, Page, expect
from served import error

from app.adapter import private
from app.adapter.private import ThreadSafeEvent
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load
from app.link.process import wait_until
from app.web.server import PageServer
from browsing.browser_actions import (
    camera,
    drag_target,
    eventually,
    is_drawn,
    key,
    new_page,
    number,
    open_page,
    position,
    press,
    row,
    set_number,
    sheet,
    tab,
    target_position,
    turn_target,
    unfold,
    wait_for_scene,
    write,
)
from browsing.scene_switch import reset_all
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings
from robots import CATALOG


@pytest.fixture
def learner(server: PageServer, page: Page) -> SimulationClient:
    """Returns the simulation of `page`."""
    assert eventually(page, lambda: bool(server.sessions.learners) and server.sessions.learners[0].attached)
    return server.sessions.learners[0]


def test_the_page_invites_and_holds(page: Page, learner: SimulationClient) -> None:
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()
    expect(page.get_by_text("Running", exact=True).first).to_be_visible()
    assert eventually(page, lambda: learner.status is not None and learner.status.t > 0.5)
    assert error(learner, "position") < 1e-3
    expect(page).to_have_title("himpc-lab")


def test_dragging_the_gizmo_moves_the_arm(page: Page, learner: SimulationClient) -> None:
    before = position(page, "/actual")
    drag_target(page, axis=1, along=0.15)
    assert eventually(page, lambda: position(page, "/actual")[1] > before[1] + 0.08)
    assert eventually(page, lambda: error(learner, "position") < 2e-3)
    # The arrows are along the world's axes for every orientation of the hand.
    assert np.allclose(np.delete(target_position(page), 1), np.delete(before, 1), atol=1e-3)
    expect(page.get_by_text("Target within reach")).to_be_visible()
    expect(page.get_by_text("Now switch a level off")).to_be_visible()


def test_rings_turn_the_target_while_its_level_is_on(page: Page, learner: SimulationClient) -> None:
    assert learner.status is not None
    before = learner.status.targets
    turn_target(page, 30.0)
    assert eventually(page, lambda: turned(learner, before["orientation"]) > np.radians(10.0))
    assert np.allclose(learner.status.targets["position"], before["position"], atol=1e-6)
    assert eventually(page, lambda: error(learner, "orientation") < np.radians(1.0))
    assert turned(learner, before["orientation"]) > np.radians(10.0)
    key(page, "2")
    assert eventually(page, lambda: not is_drawn(page, "/target/turn"))
    key(page, "2")
    assert eventually(page, lambda: is_drawn(page, "/target/turn"))


def turned(learner: SimulationClient, before: np.ndarray) -> float:
    """Returns the angle by which the orientation target was rotated since `before`, rad."""
    assert learner.status is not None
    trace = float(np.trace(learner.status.targets["orientation"] @ before.T))
    return float(np.arccos(np.clip((trace - 1) / 2, -1.0, 1.0)))


def test_an_unreachable_target_is_shown_and_breaks_nothing(page: Page, learner: SimulationClient) -> None:
    for _ in range(3):
        drag_target(page, axis=1, along=-0.6)  # away from the camera, so that it stays in the picture
    expect(page.get_by_text("Out of reach by")).to_be_visible()
    assert eventually(page, lambda: position(page, "/actual")[1] < -0.3)
    # the error from the target that the controller accepted
    assert eventually(page, lambda: error(learner, "position") < 5e-3)
    assert learner.failure is None
    press(page, "Bring the target to the hand")
    expect(page.get_by_text("Target within reach")).to_be_visible()


def test_a_level_switched_off_lets_go_and_level_1_does_not(page: Page, learner: SimulationClient) -> None:
    tab(page, "Tasks")
    key(page, "2")
    assert eventually(page, lambda: learner.settings is not None and not learner.settings.levels[1].enabled)
    expect(page.get_by_role("button", name="off", exact=True)).to_be_visible()
    drag_target(page, axis=2, along=0.2)
    assert eventually(page, lambda: error(learner, "orientation") > np.radians(3.0))
    assert eventually(page, lambda: error(learner, "position") < 2e-3)
    assert error(learner, "orientation") > np.radians(3.0)
    key(page, "2")
    assert eventually(page, lambda: error(learner, "orientation") < np.radians(1.0))


def test_levels_move_and_gains_change(page: Page, learner: SimulationClient) -> None:
    tab(page, "Tasks")
    page.get_by_role("button", name="⋯").first.click()
    set_number(page, "Q", 300)
    assert eventually(page, lambda: learner.settings is not None and learner.settings.levels[0].Q == 300)
    page.get_by_role("button", name="▼").nth(1).click()
    assert eventually(
        page,
        lambda: (
            learner.settings is not None
            and [level.name for level in learner.settings.levels] == ["position", "posture", "orientation"]
        ),
    )
    expect(page.get_by_text("2 · posture")).to_be_visible()
    reset_all(page, learner)
    expect(page.get_by_text("2 · orientation")).to_be_visible()
    assert eventually(page, lambda: number(page, "Q") == 200)


def test_N_and_M_bar_change_while_it_runs(page: Page, learner: SimulationClient) -> None:
    tab(page, "Tasks")
    set_number(page, "N", 10)
    set_number(page, "M̄ scale", 1.5)
    settings = learner.settings
    assert eventually(page, lambda: learner.settings is not None and learner.settings.horizon == 10)
    assert eventually(
        page, lambda: isinstance(learner.settings, TorqueSettings) and learner.settings.M_bar_scale == 1.5
    )
    assert settings is not None and learner.failure is None
    expect(page.get_by_text("spectral radius")).to_be_visible()
    tab(page, "Robot")
    unfold(page, "Plant")
    set_number(page, "Payload [kg]", 2)
    assert eventually(page, lambda: learner.settings is not None and learner.settings.plant.payload_kg == 2)
    assert eventually(page, lambda: error(learner, "position") < 2e-3)


def test_pause_step_reset(page: Page, learner: SimulationClient) -> None:
    drag_target(page, axis=1, along=0.15)
    assert eventually(page, lambda: position(page, "/actual")[1] > 0.05)
    assert target_position(page)[1] > 0.1
    key(page, "Space")
    expect(page.get_by_text("Paused", exact=True).first).to_be_visible()
    assert learner.status is not None
    ticks = learner.status.ticks
    press(page, "Step")
    assert eventually(page, lambda: learner.status is not None and learner.status.ticks == ticks + 1)
    key(page, "t")
    assert eventually(page, lambda: learner.status is not None and learner.status.ticks == ticks + 2)
    key(page, "r")
    assert eventually(page, lambda: abs(position(page, "/actual")[1]) < 0.01)
    assert eventually(page, lambda: abs(target_position(page)[1]) < 0.01)
    press(page, "Run")
    expect(page.get_by_text("Running", exact=True).first).to_be_visible()


def test_paused_edits_show_at_once(page: Page, learner: SimulationClient) -> None:
    """While the simulation is paused, panel, order of the stack and gauge show the edited settings at
    once."""
    key(page, "Space")
    expect(page.get_by_text("Paused", exact=True).first).to_be_visible()
    assert learner.status is not None
    t = learner.status.t
    tab(page, "Tasks")
    page.get_by_role("button", name="▼").first.click()
    expect(page.get_by_text("1 · orientation")).to_be_visible()
    page.wait_for_timeout(500)
    before = page.get_by_text("spectral radius").text_content()
    set_number(page, "M̄ scale", 3)
    assert eventually(page, lambda: page.get_by_text("spectral radius").text_content() != before)
    assert learner.status.t == t


def test_keys_are_for_the_page_or_for_the_field(page: Page, learner: SimulationClient) -> None:
    """Keys that are typed into a field are text; a toggle key that is pressed twice quickly has no effect."""
    tab(page, "Robot")
    row(page, "Hand frame").locator("input").click()
    page.keyboard.type("s 2r")
    key(page, "Tab")
    assert row(page, "Hand frame").locator("input").input_value() == "s 2r"
    page.wait_for_timeout(500)
    assert learner.status is not None and learner.status.running
    assert learner.settings is not None and learner.settings.levels[1].enabled
    tab(page, "Learn")
    for name in ("Space", "Space", "2", "2", "3"):
        key(page, name)
    assert eventually(page, lambda: learner.settings is not None and not learner.settings.levels[2].enabled)
    assert learner.settings.levels[1].enabled and learner.status.running


def test_no_thread_can_hold_up_what_is_sent(page: Page, server: PageServer) -> None:
    everybody, *each = private.senders(server._viser)
    assert each
    assert all(isinstance(event, ThreadSafeEvent) for event in (everybody, *each))


def test_the_browser_tells_which_charts_it_shows(
    page: Page, server: PageServer, learner: SimulationClient
) -> None:
    """The server sends data only for these charts."""
    pages = [each._page for each in server._visits.values() if each._page is not None]
    (shown,) = (each for each in pages if each.learner is learner)

    def sees(title: str) -> bool:
        return shown._scene is not None and shown._scene.page.in_view.sees(title)

    for name, seen, unseen in (
        ("Joints", "Torque, % of bound", "Joint nearest its bound, %"),
        ("Who binds", "", "Torque, % of bound"),
        ("Errors", "Error per task, mm or °", "Torque, % of bound"),
    ):
        tab(page, name)
        assert eventually(
            page, lambda seen=seen, unseen=unseen: sees(seen) == bool(seen) and not sees(unseen)
        )


def test_a_reload_resumes(page: Page, server: PageServer, learner: SimulationClient) -> None:
    tab(page, "Tasks")
    set_number(page, "N", 7)
    assert eventually(page, lambda: learner.settings is not None and learner.settings.horizon == 7)
    page.reload(wait_until="commit")
    wait_for_scene(page)
    assert learner in server.sessions.learners and learner.attached
    tab(page, "Tasks")
    assert eventually(page, lambda: number(page, "N") == 7)


def test_two_browsers_and_no_third(
    browser: Browser, server: PageServer, page: Page, learner: SimulationClient
) -> None:
    second = open_page(browser, server.link)
    other = server.sessions.learners[-1]
    assert other is not learner and other.pid != learner.pid
    still = position(second, "/actual")
    drag_target(page, axis=1, along=0.15)
    assert eventually(page, lambda: position(page, "/actual")[1] > still[1] + 0.08)
    assert np.allclose(position(second, "/actual"), still, atol=2e-3)
    third = new_page(browser)
    third.goto(server.link, wait_until="commit")
    expect(third.get_by_text("All places are taken")).to_be_visible(timeout=60_000)
    pid = other.pid
    second.context.close()
    assert pid is not None
    assert wait_until(lambda: other not in server.sessions.learners, 30.0)  # closing the tab ends the process
    third.get_by_role("button", name="Try again").click()
    wait_for_scene(third)
    third.context.close()


def test_a_killed_child_is_shown_and_reset_recovers(page: Page, learner: SimulationClient) -> None:
    pid = learner.pid
    assert pid is not None
    view = camera(page)
    os.kill(pid, signal.SIGKILL)
    expect(page.get_by_text("ended from outside")).to_be_visible()
    expect(page.get_by_role("button", name="Start again")).to_be_visible()
    press(page, "Reset")
    expect(page.get_by_text("Running", exact=True).first).to_be_visible()
    assert learner.pid != pid
    wait_for_scene(page)
    page.wait_for_timeout(500)
    assert np.allclose(camera(page), view, atol=1e-3)  # the view is the same as before
    # The page is built again for the new process; the next test must not press what is removed then.
    assert eventually(page, lambda: learner.status is not None and learner.status.t > 3.0)


def test_wrong_robots_are_one_sentence_and_uploads_work(
    page: Page, learner: SimulationClient, tmp_path: Path
) -> None:
    tab(page, "Robot")
    write(page, "File", "/nowhere/<b>robot</b>.urdf")
    press(page, "Load file")
    expect(page.get_by_text("only files below the folder")).to_be_visible()
    # shown as text, not interpreted as HTML
    expect(page.get_by_text("/nowhere/<b>robot</b>.urdf")).to_be_visible()
    write(page, "File", "<b>robot</b>.urdf")
    press(page, "Load file")
    expect(page.get_by_text("NOT LOADED")).to_be_visible()
    expect(page.get_by_text("<b>robot</b>.urdf")).to_be_visible()
    broken = tmp_path / "broken.urdf"
    broken.write_text("<robot name='x'><link")
    _upload(page, broken)
    expect(page.get_by_text("not well-formed")).to_be_visible()
    assert learner.ready is not None and learner.ready.robot.n == 7
    mine = tmp_path / "mine.urdf"
    text = CATALOG["planar3"].path.read_text()
    hostile = "&lt;img src=x onerror=window.hacked=1&gt;"
    mine.write_text(re.sub(r'<robot name="[^"]*"', f'<robot name="{hostile}"', text, count=1))
    _upload(page, mine)
    assert eventually(page, lambda: learner.ready is not None and learner.ready.robot.n == 3)
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()  # the panel was built again
    tab(page, "Robot")
    expect(page.get_by_text("3 joints").first).to_be_visible()
    assert page.evaluate("() => window.hacked") is None
    assert eventually(page, lambda: learner.status is not None and learner.status.t > 0.3)


def test_a_folder_and_a_file_are_dropped_on_the_robot_tab(
    page: Page, learner: SimulationClient, tmp_path: Path
) -> None:
    """The folder's mesh comes along, in a zip that the browser makes; the file is in Latin-1."""
    text = CATALOG["planar3"].path.read_text()
    folder = tmp_path / "mine"
    for name in ("urdf", "meshes"):
        (folder / name).mkdir(parents=True)
    mesh = "o\nv 0 0 0\nv 0.1 0 0\nv 0 0.1 0\nv 0 0 0.1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n"
    (folder / "meshes" / "part.obj").write_text(mesh + "# a comment\n" * 5000)
    visual = '<visual><geometry><mesh filename="package://mine/meshes/part.obj"/></geometry></visual>'
    at = text.index(">", text.index("<link", text.index("<link") + 1)) + 1
    (folder / "urdf" / "arm.urdf").write_text(text[:at] + visual + text[at:])
    tab(page, "Robot")
    _drop(page, folder)
    assert eventually(page, lambda: learner.ready is not None and bool(learner.ready.robot.surfaces))
    assert learner.ready is not None and "not found" not in str(learner.ready.robot.report.findings)
    (tmp_path / "Größe.urdf").write_bytes(
        text.replace('name="planar3"', 'name="Größe"').encode("latin-1", "replace")
    )
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()
    tab(page, "Robot")
    _drop(page, tmp_path / "Größe.urdf")
    assert eventually(page, lambda: learner.ready is not None and learner.ready.robot.name == "Größe")


def _drop(page: Page, path: Path) -> None:
    browser = page.context.new_cdp_session(page)
    dragged = {"items": [], "files": [str(path)], "dragOperationsMask": 1}
    for kind in ("dragEnter", "dragOver", "drop"):
        browser.send("Input.dispatchDragEvent", {"type": kind, "x": 200, "y": 200, "data": dragged})


def _upload(page: Page, path: Path) -> None:
    with page.expect_file_chooser() as chooser:
        page.get_by_role("button", name="Upload a URDF").click()
    chooser.value.set_files(path)


def test_other_scenes_and_the_phone(browser: Browser, server: PageServer) -> None:
    phone = open_page(browser, server.link, 390, 844)
    learner = server.sessions.learners[-1]
    expect(phone.get_by_text("Drag the target by its arrows")).to_be_visible()
    left, right = sheet(phone)
    assert left < 1 and 389 <= right <= 391  # the sheet has the width of the screen
    tab(phone, "More")
    tab(phone, "Robot")
    phone.get_by_role("button", name="Load robot").scroll_into_view_if_needed()
    learner.send(Load(SceneChoice(RunSpec("iiwa14-circle"))))
    assert eventually(
        phone, lambda: learner.ready is not None and learner.ready.choice.run.scene == "iiwa14-circle"
    )
    wait_for_scene(phone, "/reference/0")
    expect(phone.get_by_text("Watch the hand follow the curve")).to_be_visible()
    phone.context.close()
