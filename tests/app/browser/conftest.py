"""Reports of browser tests that failed contain the text that their pages showed. A test fails if a script of
a page raised an error."""

from __future__ import annotations

from collections.abc import Generator, Iterator
from contextlib import suppress
from typing import Any

import pytest
from playwright.sync_api import Error, Page

from browsing.browser_actions import FAULTS


@pytest.fixture(autouse=True)
def no_script_fails() -> Iterator[None]:
    FAULTS.clear()
    yield
    assert FAULTS == []


@pytest.hookimpl(wrapper=True)
def pytest_runtest_makereport(item: pytest.Item) -> Generator[None, pytest.TestReport, pytest.TestReport]:
    report = yield
    if report.failed:
        arguments: dict[str, Any] = getattr(item, "funcargs", {})
        for name, value in arguments.items():
            if isinstance(value, Page):
                with suppress(Error):  # the page may have been closed
                    report.sections.append(
                        (f"Text of {name}", value.locator("body").inner_text(timeout=5000))
                    )
    return report
