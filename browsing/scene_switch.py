"""Loads another scene, or the same scene again, on an open page. This is faster than opening a new page."""

from __future__ import annotations

import math
import re

from playwright.sync_api import Page, expect

from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.messages import Load, Status
from browsing.browser_actions import eventually, press, tab, wait_for_scene

_SOON = 2.0
"""Simulated time, s, up to which every run is accepted as a new run."""


def reset_all(page: Page, learner: SimulationClient) -> None:
    """Presses "Reset all", and waits until the simulation runs from the beginning and the page shows it.
    Before that, the page may replace a control, and a click on it has no effect."""
    before = learner.status
    press(page, "Reset all")
    if before is not None:
        assert eventually(page, lambda: _began_after(learner.status, before))
        assert eventually(page, lambda: _time_shown(page) < max(before.t, _SOON))
    expect(page.get_by_text("Running", exact=True).first).to_be_visible()
    wait_for_scene(page)


def _began_after(status: Status | None, before: Status) -> bool:
    """Returns whether the run began after the status `before`. A process that replaces a failed process
    counts its resets from 1."""
    return status is not None and (status.resets != before.resets or status.t < before.t)


def _time_shown(page: Page) -> float:
    found = re.search(r"Running\W+([\d.]+) s", page.locator("body").inner_text())
    return float(found[1]) if found else math.inf


def show_scene(page: Page, learner: SimulationClient, choice: SceneChoice) -> None:
    """Loads a torque-level scene, unless it is already loaded, and waits until the page is rebuilt."""
    if learner.choice == choice:
        return
    tab(page, "Robot")  # a rebuilt page shows another tab first
    learner.send(Load(choice))
    assert eventually(page, lambda: learner.choice == choice)
    expect(page.get_by_text("Drag the target by its arrows")).to_be_visible()
    wait_for_scene(page)
