"""Runs a JupyterHub with two users: both press the icon of himpc-lab, run a step of a lesson, and hand in.

    PATH=FOLDER/node_modules/.bin:$PATH python -m benchmarks.hub [--pictures FOLDER]

The program needs the hub's own proxy (`npm install configurable-http-proxy`) and a Chromium. The exit code is
0 if two conditions hold. First, both handed-in texts are signed and name only the account of the hub and the
step. Second, every request that does not come through the user's own Jupyter server is refused: over the port
itself, over Jupyter's path for any port, and without a login. The program prints the waiting times of the two
users.
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from http.client import HTTPConnection
from pathlib import Path
from urllib.parse import urlsplit

from playwright.sync_api import Page, sync_playwright

from app.web.passes import HEADER, QUERY, USER_HEADER
from browsing.browser_actions import CHROMIUM_ARGS, find_chromium
from browsing.hub import LESSON, find_proxy, hand_in, hub, log_in, open_lab, port_of_lab, run_first_step
from lessons.replay.progress import read_handed_in

KEY = "the key of the instructor of this hub"
USERS = ("zoe", "ben")


def main() -> int:
    """Runs the hub, and prints the waiting times of the users and what went wrong."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--pictures", type=Path, default=None)
    pictures: Path | None = parser.parse_args().pictures
    proxy, chromium = find_proxy(), find_chromium()
    if proxy is None or chromium is None:
        print("This benchmark needs Chromium, and configurable-http-proxy of npm in PATH.", file=sys.stderr)
        return 2
    with (
        tempfile.TemporaryDirectory(ignore_cleanup_errors=True) as folder,
        hub(Path(folder), proxy, KEY) as url,
        sync_playwright() as playwright,
    ):
        browser = playwright.chromium.launch(executable_path=chromium, args=CHROMIUM_ARGS)
        failures: list[str] = []
        for user in USERS:
            began = time.monotonic()
            launcher = log_in(browser, url, user)
            logged_in = time.monotonic()
            page = open_lab(launcher)
            opened = time.monotonic()
            run_first_step(page)
            ran = time.monotonic()
            failures += judged(hand_in(page), user)
            failures += let_in(launcher, url, user, port_of_lab(Path(folder)))
            print(
                f"{user}: launcher after {logged_in - began:.1f} s, robot {opened - logged_in:.1f} s later, "
                f"step run in {ran - opened:.1f} s"
            )
            if pictures is not None:
                pictures.mkdir(parents=True, exist_ok=True)
                launcher.screenshot(path=pictures / f"launcher-{user}.png")
                page.screenshot(path=pictures / f"page-{user}.png")
            page.context.close()
        browser.close()
    for each in failures:
        print(f"wrong: {each}")
    return 1 if failures else 0


def judged(text: str, user: str) -> list[str]:
    """Returns what is wrong with the text that a user hands in."""
    handed, proof = read_handed_in(text, KEY.encode())
    wrong = [] if proof == "signed" else [f"{user}: {proof}"]
    if (handed.account, handed.progress.seen) != (user, {LESSON: frozenset({0})}):
        wrong.append(f"{user}: the text says {handed.account!r} and {handed.progress.seen}")
    return wrong


def let_in(page: Page, url: str, user: str, port: int) -> list[str]:
    """Returns the addresses at which a user's lab accepts requests without the user's Jupyter server. There
    should be none."""
    forged = {USER_HEADER: "somebody", HEADER: "somebody's-token"}
    ways = {
        "the port": (f"http://127.0.0.1:{port}/", {}),
        "the port with a user's name": (f"http://127.0.0.1:{port}/", forged),
        "the port with a token in the address": (f"http://127.0.0.1:{port}/?{QUERY}=anything-at-all", {}),
        "another user's path without a login": (f"{url}/user/{user}/himpc-lab/page", {}),
    }
    open_ways = [f"{user}: {name} is open" for name, way in ways.items() if status(*way) == 200]
    # A request of the user's own browser over Jupyter's path for any port, which sends no token.
    answer = page.request.get(f"{url}/user/{user}/proxy/{port}/", headers=forged)
    return [*open_ways, *([f"{user}: /proxy/PORT is open"] if answer.status != 403 else [])]


def status(url: str, headers: dict[str, str]) -> int:
    """Returns the status of the answer. Redirects are not followed."""
    parts = urlsplit(url)
    connection = HTTPConnection(parts.hostname or "", parts.port or 80, timeout=30.0)
    connection.request("GET", f"{parts.path}?{parts.query}", headers=headers)
    found = connection.getresponse().status
    connection.close()
    return found


if __name__ == "__main__":
    sys.exit(main())
