"""Measures memory over many changes of lesson, in a real browser and in the server.

    python -m benchmarks.memory [--switches 50]

The program opens one lesson after another by its card, and runs its first step for a moment. It measures the
page's heap (after a garbage collection) and the server's memory when every lesson has been open twice,
because until then the browser compiles frequent code and keeps it in its heap. It measures both again after
the given number of further changes. It prints JSON. The exit code is 0 if both grew by less than 10 %.
"""

from __future__ import annotations

import argparse
import gc
import json
import os
import sys
from typing import Any

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import psutil
from playwright.sync_api import Page, expect, sync_playwright

from app.link.choice import SceneChoice
from app.web.server import PageServer
from browsing.browser_actions import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, open_page
from browsing.lessons import open_lesson
from lessons.course import COURSE, load_lesson
from lessons.scenes.run_spec import RunSpec

GROWTH = 1.1


def main() -> int:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--switches", type=int, default=50)
    switches = parser.parse_args().switches
    server = PageServer(SceneChoice(RunSpec("iiwa14-hold")), port=0, max_sessions=1)
    expect.set_options(timeout=SLOW)
    with sync_playwright() as playwright:
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
        page = open_page(browser, server.link, 1200, 700, rest=SELDOM)
        try:
            for count in range(2 * len(COURSE)):
                switch(page, count)
            before = memory(page)
            for count in range(switches):
                switch(page, count)
            after = memory(page)
        finally:
            browser.close()
            server.close()
    print(json.dumps({"switches": switches, "after warm-up": before, "at the end": after}, indent=1))
    return 0 if all(after[name] < GROWTH * before[name] for name in before) else 1


def switch(page: Page, count: int) -> None:
    """Opens another lesson, and runs it for a moment."""
    open_lesson(page, load_lesson(COURSE[count % len(COURSE)]))
    run = page.get_by_role("button", name="Run this step", exact=True)
    if run.count() and run.is_enabled():
        run.click()
    page.wait_for_timeout(500)


def memory(page: Page) -> dict[str, float]:
    """Returns the MB of the page's heap and of the server, after a moment without activity."""
    # The visible lesson adds to the heap, so the measurement always uses the same lesson.
    open_lesson(page, load_lesson(COURSE[0]))
    page.wait_for_timeout(4000)
    gc.collect()
    session: Any = page.context.new_cdp_session(page)
    for _ in range(3):
        session.send("HeapProfiler.collectGarbage")
    heap = session.send("Runtime.getHeapUsage")["usedSize"]
    session.detach()
    return {
        "page heap MB": round(1e-6 * heap, 1),
        "server MB": round(1e-6 * psutil.Process().memory_info().rss, 1),
    }


if __name__ == "__main__":
    sys.exit(main())
