"""Reports of browser tests that failed contain the text that their pages showed."""

from __future__ import annotations

from collections.abc import Generator
from contextlib import suppress
from typing import Any

import pytest
from playwright.sync_api import Error, Page


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
