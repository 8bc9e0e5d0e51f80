"""One minute of random actions in a real browser."""

from __future__ import annotations

import pytest
from playwright.sync_api import Browser

from benchmarks.monkey import Monkey, attack


@pytest.mark.nightly("benchmarks/monkey.py", "app/link", "app/page")
def test_a_minute_of_anything_breaks_nothing(browser: Browser) -> None:
    found = attack(lambda server, found: Monkey(browser, server, found), "planar3-hold", 60.0, seed=0)
    assert found.faults == []
    assert found.rows > 0
    assert sum(found.actions.values()) > 3
