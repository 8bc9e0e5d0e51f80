"""The first start, when nothing is compiled: the page opens at once and shows the progress of compilation."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
from pathlib import Path

import pytest
from playwright.sync_api import Browser

from app.link.process import wait_until
from browsing.browser_actions import SLOW, eventually, new_page, position

ROOT = Path(__file__).parents[3]
COMMAND = [sys.executable, "-m", "app", "--port", "0", "--scene", "iiwa14-hold"]


@pytest.mark.nightly("app/", "browsing/", "himpc/compilation")
def test_the_page_opens_while_it_is_compiled(browser: Browser, tmp_path: Path) -> None:
    """The command opens a file in the browser, which redirects to the page. The page counts the compiled
    functions and shows a recorded run."""
    said, program = tmp_path / "said", tmp_path / "browser"
    program.write_text(f'#!/bin/sh\necho "$1" > {said}.part && mv {said}.part {said}\n')
    program.chmod(0o755)
    own = {"PYTHONPATH": str(ROOT), "NUMBA_CACHE_DIR": str(tmp_path / "cache"), "BROWSER": str(program)}
    page = new_page(browser)
    with subprocess.Popen(COMMAND, cwd=ROOT, env={**os.environ, **own}, stdout=subprocess.DEVNULL) as lab:
        try:
            assert wait_until(said.exists, 60.0)
            page.goto(said.read_text().strip(), wait_until="commit", timeout=SLOW)
            page.wait_for_url(re.compile(r"^http://[^?]*/$"), wait_until="commit", timeout=SLOW)

            def ready() -> int:
                found = re.search(r"(\d+) of \d+ functions", page.content())
                return int(found[1]) if found else 0

            assert eventually(page, lambda: ready() > 0, 60.0)
            first = ready()
            assert eventually(page, lambda: ready() > first, 60.0)
            assert page.get_by_text("PREPARING").is_visible()
            recorded = page.get_by_text("The robot plays a recorded run of this lesson.")
            assert eventually(page, recorded.is_visible, 60.0)
            seen = position(page, "/recorded/7")
            assert eventually(page, lambda: position(page, "/recorded/7") != seen, 10.0)
            assert not page.get_by_text("Start again").is_visible()
        finally:
            page.context.close()
            lab.send_signal(signal.SIGINT)
