"""Measures the size and the time of the first view of *Try it*.

    python -m benchmarks.first_view SITE [SITE ...] [--runs N]

The program opens try.html of each site in turn, each time in a new Chromium, until the robot moves. `python
-m docs.build` writes such sites. The program prints the size of the scripts (MB, and compressed by gzip -9)
and medians of times, s. The times are those from the opening of the page to its first picture and to the
robot's first motion. The program also prints the processor time until this motion, s: of the page's thread,
the simulation's thread, the threads that compile WebAssembly, and the whole browser. Chromium draws with the
processor here (SwiftShader).
"""

from __future__ import annotations

import argparse
import gzip
import statistics
from collections import defaultdict
from pathlib import Path

import psutil
from playwright.sync_api import Playwright, sync_playwright

from browsing.browser_actions import CHROMIUM_ARGS, SLOW, find_chromium

WATCH = """(() => {
  const draw = WebGL2RenderingContext.prototype.drawElements;
  WebGL2RenderingContext.prototype.drawElements = function (...given) {
    window.pictured ??= performance.now();
    return draw.apply(this, given);
  };
  const look = () => {
    const frame = window.HIMPC?.shown?.frame;
    if (frame?.running && frame.t > 0.02) window.moved = performance.now();
    else setTimeout(look, 5);
  };
  look();
})()"""
THREADS = {"chromium": "page", "DedicatedWorker": "simulation", "ThreadPoolForeg": "compilation"}
"""Threads of the process that draws the page, as Linux names them."""
SHOWN = ("picture", "moves", *THREADS.values(), "all")
SCRIPTS = ("live", "mujoco", "kernel", "iiwa14-hold", "robot-iiwa14")


def main() -> None:
    """Measures as the command line says."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("sites", type=Path, nargs="+")
    parser.add_argument("--runs", type=int, default=5)
    given = parser.parse_args()
    found: dict[Path, list[dict[str, float]]] = defaultdict(list)
    with sync_playwright() as playwright:
        for _ in range(given.runs):
            for site in given.sites:
                found[site].append(_opened(playwright, site.resolve() / "try.html"))
    for site, runs in found.items():
        scripts = [(site / "live" / f"{name}.js").read_bytes() for name in SCRIPTS]
        size, packed = (sum(map(len, each)) / 1e6 for each in (scripts, map(gzip.compress, scripts)))
        told = ", ".join(f"{name} {statistics.median(run[name] for run in runs):.2f}" for name in SHOWN)
        print(f"{site}: {size:.1f} MB, compressed {packed:.1f} MB; median of {given.runs}: {told}")
    print(f"load of this machine at the end: {psutil.getloadavg()[0]:.0f}")


def _opened(playwright: Playwright, page: Path) -> dict[str, float]:
    """Returns the times until the robot is drawn and until it moves, and the processor time until then, s."""
    browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
    tab = browser.new_page(viewport={"width": 1440, "height": 900})
    tab.add_init_script(WATCH)
    tab.goto("about:blank")
    before = _spent()
    tab.goto(page.as_uri() + "#iiwa14-hold")
    tab.wait_for_function("() => window.moved", timeout=SLOW)
    after = _spent()
    times = tab.evaluate("({ picture: window.pictured / 1e3, moves: window.moved / 1e3 })")
    browser.close()
    spent = {name: after.get(name, 0.0) - before.get(name, 0.0) for name in (*THREADS.values(), "all")}
    return times | spent


def _spent() -> dict[str, float]:
    """Returns the processor time that the browser's threads have used so far, s."""
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
