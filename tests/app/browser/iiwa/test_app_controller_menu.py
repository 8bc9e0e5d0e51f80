"""Switching the controller on the page, in a real browser."""

from __future__ import annotations

from functools import partial

import numpy as np
from playwright.sync_api import Page, expect

from app.client.simulation_client import SimulationClient
from app.web.server import PageServer
from browsing.browser_actions import eventually, row, tab
from himpc.catalog import CONTROLLERS


def runs(learner: SimulationClient, name: str) -> bool:
    return learner.settings is not None and learner.settings.controller == name


def test_the_menu_switches_the_controller_while_the_robot_moves(page: Page, server: PageServer) -> None:
    """The menu offers every registered name with its description; the hand does not move during the
    switch."""
    assert eventually(page, lambda: bool(server.sessions.learners) and server.sessions.learners[0].attached)
    learner = server.sessions.learners[0]
    tab(page, "Control")
    for name in ("weighted", "hqp", "himpc"):
        row(page, "Controller").locator("input").first.click()
        names = [option.strip() for option in page.get_by_role("option").all_inner_texts()]
        assert names == list(CONTROLLERS)
        page.get_by_role("option", name=name, exact=True).click()
        assert eventually(page, partial(runs, learner, name))
        expect(page.get_by_text(CONTROLLERS[name])).to_be_visible()
    found = learner.read(lambda _, history: (history.layout, history.latest))
    assert found is not None
    layout, latest = found
    assert np.abs(latest[layout.fields["error/position"]]).max() < 1e-3
    assert learner.failure is None
