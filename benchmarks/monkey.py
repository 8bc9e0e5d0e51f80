"""A user who tries everything at random. The page must keep working, and the robot must stay within its
bounds.

    python -m benchmarks.monkey [--minutes M] [--seed N] [--scene S] [--hostile]

The user has a browser. With --hostile the user has only the page's protocol instead, and sends messages that
no browser would send, see benchmarks/hostile.py. The program prints all actions as JSON. The exit code is 1
if there was a fault.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import sys
import time
from collections.abc import Callable
from contextlib import suppress

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from playwright.sync_api import Browser, Error, Locator, Page, sync_playwright

from app.client.decimated import History
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.ring import Block
from app.web.server import PageServer
from benchmarks.findings import Findings, StandardError
from benchmarks.roam import roam
from browsing.browser_actions import CHROMIUM_ARGS, SELDOM, SLOW, find_chromium, load, open_page, tab
from lessons.scenes.run_spec import RunSpec
from lessons.settings.torque import TorqueSettings

STRICT = ("himpc", "hiqp", "nhimpc")
"""Controllers that keep priorities up to rounding errors."""
UNBOUNDED = ("osf", "osf_damped", "tdeosf", "tdeosf_damped")
LEAK = 1e-6
"""Leak into a higher level that is still allowed, m/s² or rad/s²."""
BOUND = 1e-9
"""Excess over a torque bound, N·m, that counts as a rounding error."""
ANSWER = 60.0
"""Time, s, after which a page counts as dead if it shows nothing new although its robot should move."""
_PATIENCE = 1_500
"""Time, ms, for an element to accept a click; a covered or removed element is not clicked."""
_HOTKEYS = ("Space", "?", "Escape", "ArrowLeft", "ArrowRight", *"123nbrsdltjk")
_PANELS = ("Learn", "Tasks", "Control", "Robot", "More", "Errors", "Joints", "Who binds")


class Monkey:
    """One browser tab of one learner, with one stream of random numbers."""

    def __init__(self, page: Page, server: PageServer, seed: int, complaints: Callable[[], str]) -> None:
        """complaints: everything that was written to standard error so far."""
        self.page, self.server = page, server
        self.found = Findings(seed)
        self._random = random.Random(seed)
        self._complaints = complaints
        self._seen = 0
        self._block: Block | None = None
        self._unbounded: Block | None = None
        self._moved = (time.monotonic(), -1)
        page.on("pageerror", self._hear_error)
        page.on("dialog", lambda dialog: dialog.dismiss())

    @property
    def learner(self) -> SimulationClient:
        return self.server.sessions.learners[0]

    def act(self) -> None:
        """Does one random action of a user."""
        actions: list[tuple[Callable[[], None], float]] = [
            (self._click, 6.0),
            (self._tab, 5.0),
            (self._type, 6.0),
            (self._toggle, 3.0),
            (self._choose, 2.0),
            (self._key, 3.0),
            (self._drag, 4.0),
            (self._wait, 3.0),
            (self._lesson, 1.0),
            (self._reload, 0.1),
        ]
        chosen = self._random.choices([each for each, _ in actions], [weight for _, weight in actions])[0]
        # An element may be removed or covered between the check and the click.
        with suppress(Error):
            chosen()
            self.found.actions[chosen.__name__.strip("_")] += 1

    def _hear_error(self, error: Error) -> None:
        # Viser's button that saves the picture opens a file dialog, which nobody would close.
        if "showSaveFilePicker" not in error.message:
            self.found.blame(f"the browser: {error}")

    # ---------------------------------------------------------------- the user's actions

    def _one(self, selector: str) -> Locator | None:
        elements = self.page.locator(selector)
        count = elements.count()
        return elements.nth(self._random.randrange(count)) if count else None

    def _click(self) -> None:
        button = self._one("button:visible:enabled:not([role=tab])")
        if button is not None:
            button.click()

    def _tab(self) -> None:
        if self._random.random() < 0.5:
            tab(self.page, self._random.choice(_PANELS))
        elif (found := self._one("button[role=tab]:visible")) is not None:
            found.click()

    def _type(self) -> None:
        box = self._one("input[type=text]:visible:enabled, input[inputmode]:visible:enabled")
        if box is None:
            return
        exponent = self._random.uniform(-4, 4)
        texts = (f"{10**exponent:.4g}", f"{-(10**exponent):.4g}", "0", "1e9", "nan", "-", "word", "[1, 2]")
        box.fill(self._random.choices(texts, (20, 4, 2, 1, 1, 1, 1, 1))[0])
        box.press("Enter")

    def _toggle(self) -> None:
        box = self._one("input[type=checkbox]:visible:enabled")
        if box is not None:
            box.click()

    def _choose(self) -> None:
        menu = self._one("input[aria-haspopup=listbox]:visible:enabled")
        if menu is None:
            return
        menu.click()
        self.page.wait_for_timeout(200)
        option = self._one("[role=option]:visible")
        if option is not None:
            option.click()

    def _key(self) -> None:
        self.page.keyboard.press(self._random.choice(_HOTKEYS))

    def _drag(self) -> None:
        size = self.page.viewport_size or {"width": 1000, "height": 400}
        place = [(self._random.uniform(0.3, 0.7) * size["width"], self._random.random() * size["height"])]
        for _ in range(4):
            x, y = place[-1]
            place.append((x + self._random.gauss(0, 80), y + self._random.gauss(0, 80)))
        self.page.mouse.move(*place[0])
        self.page.mouse.down()
        for point in place[1:]:
            self.page.mouse.move(*point)
        self.page.mouse.up()

    def _wait(self) -> None:
        self.page.wait_for_timeout(self._random.uniform(50, 1500))

    def _lesson(self) -> None:
        self.page.keyboard.press("l")
        cards = ".mantine-Modal-content button:has-text('·')"
        self.page.locator(cards).first.wait_for(timeout=4 * _PATIENCE)
        card = self._one(cards)
        if card is not None:
            card.click()

    def _reload(self) -> None:
        load(self.page, self.server.link)

    # ---------------------------------------------------------------- checks

    def look(self) -> None:
        """Checks everything that happened since the last check."""
        if "Traceback" in (said := self._complaints()):
            self.found.blame("on the terminal: " + said[said.index("Traceback") :][-1500:])
        learner = self.learner
        if learner.failure is not None:
            self.found.blame(f"the simulation: {learner.failure}")
        if learner.ready is not None:
            self.found.scenes.add(learner.choice.run.scene)
        if learner.lecture is not None:
            self.found.lessons.add(learner.lecture.exercise.lesson)
        learner.read(self._judge)
        self._is_alive(learner)

    def _judge(self, block: Block, history: History) -> None:
        if block is not self._block:
            self._block, self._seen = block, 0
        start, rows = block.since(self._seen)
        self._seen = start + len(rows)
        self.found.rows += len(rows)
        if not len(rows):
            return
        fields = history.layout.fields
        for name in ("q", "v", "tau"):
            if not np.isfinite(rows[:, fields[name]]).all():
                self.found.blame(f"{name} is not a number in {self._where()}")
        settings = self.learner.settings
        if not isinstance(settings, TorqueSettings):
            return
        # Null-space methods have no bounds: motors without saturation apply any requested torque.
        if settings.controller in UNBOUNDED and not settings.plant.saturate:
            self._unbounded = block
        if self._unbounded is not block:
            self._judge_torque(rows, fields)
        if settings.controller in STRICT:
            leak = float(np.nanmax(rows[:, fields["priority_leak"]], initial=0.0))
            self.found.worst_leak = max(self.found.worst_leak, leak)
            if leak > LEAK:
                self.found.blame(f"leak {leak:.3g} in {self._where()}")

    def _judge_torque(self, rows: np.ndarray, fields: dict[str, slice]) -> None:
        tau = rows[:, fields["tau"]]
        beyond = np.fmax(rows[:, fields["tau_lower"]] - tau, tau - rows[:, fields["tau_upper"]])
        if float(np.nanmax(beyond, initial=0.0)) > BOUND:
            self.found.blame(f"torque {np.nanmax(beyond):.3g} N·m beyond its bound in {self._where()}")

    def _where(self) -> str:
        ready, settings = self.learner.ready, self.learner.settings
        return f"{ready.choice.run.scene if ready else '?'} with {settings.controller if settings else '?'}"

    def _is_alive(self, learner: SimulationClient) -> None:
        status, now = learner.status, time.monotonic()
        ticks = -1 if status is None else status.ticks
        resting = status is not None and not status.running
        if resting or ticks != self._moved[1]:
            self._moved = (now, ticks)
        if now - self._moved[0] > ANSWER:
            asked = (
                ""
                if status is None
                else f", speed {status.speed:g}, {status.real_time_factor:.2g} × real time"
            )
            self.found.blame(f"no new tick after tick {ticks} for {ANSWER:g} s in {self._where()}{asked}")
        try:
            self.page.evaluate("() => document.title")
        except Error as error:
            self.found.blame(f"the page does not answer: {error}")


def walk(
    browser: Browser, server: PageServer, minutes: float, seed: int, complaints: Callable[[], str]
) -> Findings:
    """Does random actions for a number of minutes. It ends early after a fault."""
    # In a smaller window, viser's statistics panel has no canvas to draw on, which a random user
    # finds after some time.
    page = open_page(browser, server.link, scale=0.5, rest=SELDOM)
    page.set_default_timeout(_PATIENCE)
    page.set_default_navigation_timeout(SLOW)
    monkey = Monkey(page, server, seed, complaints)
    end = time.monotonic() + 60 * minutes
    try:
        while time.monotonic() < end and not monkey.found.faults:
            monkey.act()
            monkey.look()
    finally:
        page.context.close()
    return monkey.found


def main() -> int:
    parser = argparse.ArgumentParser(description="A random user of the page.")
    parser.add_argument("--minutes", type=float, default=1.0)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--scene", default="iiwa14-hold")
    parser.add_argument("--hostile", action="store_true")
    given = parser.parse_args()
    found = hostile(given) if given.hostile else usual(given)
    print(json.dumps(found.as_data(), indent=1))
    return 1 if found.faults else 0


def hostile(given: argparse.Namespace) -> Findings:
    """Runs the hostile user, without a browser."""
    with StandardError() as said:
        server = PageServer(SceneChoice(RunSpec(given.scene)), port=0, max_sessions=4, grace=0.2)
        try:
            return roam(server, 60.0 * given.minutes, given.seed, said.read)
        finally:
            server.close()


def usual(given: argparse.Namespace) -> Findings:
    """Runs the usual user, in a browser."""
    with StandardError() as said, sync_playwright() as playwright:
        server = PageServer(SceneChoice(RunSpec(given.scene)), port=0, max_sessions=1)
        browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
        try:
            return walk(browser, server, given.minutes, given.seed, said.read)
        finally:
            browser.close()
            server.close()


if __name__ == "__main__":
    sys.exit(main())
