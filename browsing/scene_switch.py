"""Loads another scene on an open page, or the present one anew, which is quicker than opening a new page."""

from __future__ import annotations

from playwright.sync_api import Page, expect

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load
from browsing.browser_actions import eventually, press, tab, wait_for_scene


def reset_all(page: Page, learner: SimulationClient) -> None:
    """Presses "Reset all", and waits until the simulation runs from the beginning. Before that, the page
    shows the previous state, and a click on a control that is about to be replaced has no effect."""
    before = None if learner.status is None else learner.status.resets
    press(page, "Reset all")
    assert eventually(page, lambda: learner.status is not None and learner.status.resets != before)
    expect(page.get_by_text("RUNNING", exact=True).first).to_be_visible()
    wait_for_scene(page)


def show_scene(page: Page, learner: SimulationClient, choice: SceneChoice) -> None:
    """Loads a torque-level scene, if it is not already loaded, and waits until the page is rebuilt."""
    if learner.choice == choice:
        return
    tab(page, "Robot")  # a rebuilt page begins with another tab
    learner.send(Load(choice))
    assert eventually(page, lambda: learner.choice == choice)
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()
    wait_for_scene(page)
