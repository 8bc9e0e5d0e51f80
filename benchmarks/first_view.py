"""What the first view of *Try it* costs.

    python -m benchmarks.first_view SITE [--runs N]

Opens try.html of a site that `python -m docs.build` wrote, each time in a new Chromium, until the robot
moves. Prints the time, and the processor time of the page's thread, of the simulation's thread, of the
threads that compile WebAssembly, and of the whole browser, in s.
"""

from __future__ import annotations

import argparse
import time
from collections import defaultdict
from pathlib import Path

import psutil
from playwright.sync_api import Playwright, sync_playwright

from browsing.browser_actions import CHROMIUM_ARGS, SLOW, find_chromium

MOVES = "() => HIMPC.shown?.frame?.running && HIMPC.shown.frame.t > 0.02"
THREADS = {"chromium": "page", "DedicatedWorker": "simulation", "ThreadPoolForeg": "compilation"}
"""Threads of the process that draws the page, as Linux names them."""


def main() -> None:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("site", type=Path)
    parser.add_argument("--runs", type=int, default=3)
    given = parser.parse_args()
    with sync_playwright() as playwright:
        for _ in range(given.runs):
            wall, spent = _opened(playwright, given.site.resolve() / "try.html")
            waiting = psutil.getloadavg()[0]
            told = ", ".join(f"{name} {spent[name]:.2f}" for name in (*THREADS.values(), "all"))
            print(f"{wall:.1f} s until it moves (load {waiting:.0f}); processor time: {told}")


def _opened(playwright: Playwright, page: Path) -> tuple[float, dict[str, float]]:
    """Time until the robot moves, and the processor time that it took, s."""
    browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
    tab = browser.new_page(viewport={"width": 1440, "height": 900})
    tab.goto("about:blank")
    before, begun = _spent(), time.perf_counter()
    tab.goto(page.as_uri() + "#iiwa14-hold")
    tab.wait_for_function(MOVES, timeout=SLOW)
    wall, after = time.perf_counter() - begun, _spent()
    browser.close()
    return wall, {name: used - before.get(name, 0.0) for name, used in after.items()}


def _spent() -> dict[str, float]:
    """Processor time so far of the browser's threads, s."""
    found: dict[str, float] = defaultdict(float)
    for process in psutil.Process().children(recursive=True):
        try:
            drawing = "--type=renderer" in process.cmdline()
            for thread in process.threads():
                used = thread.user_time + thread.system_time
                found["all"] += used
                name = Path(f"/proc/{process.pid}/task/{thread.id}/comm").read_text().strip()
                if drawing and name in THREADS:
                    found[THREADS[name]] += used
        except (psutil.Error, OSError):
            pass  # the process or thread has ended
    return found


if __name__ == "__main__":
    main()
