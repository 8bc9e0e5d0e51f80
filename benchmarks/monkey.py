"""A user who tries everything at random. The page must keep working, and the robot must stay within its
bounds.

    python -m benchmarks.monkey [--minutes M] [--seed N] [--scene S] [--hostile]

The user has a browser. With --hostile the user has only the page's protocol instead, and sends messages that
no browser would send, see benchmarks/hostile.py. Every action is done at least once; then actions are chosen
at random. After each action everything that happened is judged, and the attack ends early after a fault. The
program prints all actions as JSON. The exit code is 1 if there was a fault.
"""

from __future__ import annotations

import json
import os
import sys
import tempfile
import time
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from random import Random

import tyro

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import numpy as np
from playwright.sync_api import Browser, Error, Locator, sync_playwright

from app.client.decimated import History
from app.client.simulation_client import SimulationClient
from app.link.choice import SceneChoice
from app.link.ring import Block
from app.web.server import PageServer
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


@dataclass
class Findings:
    """The actions of a random walk and the faults that it found."""

    seed: int
    actions: Counter[str] = field(default_factory=Counter)
    rows: int = 0
    scenes: dict[str, None] = field(default_factory=dict)
    lessons: dict[str, None] = field(default_factory=dict)
    worst_leak: float = 0.0
    faults: list[str] = field(default_factory=list)

    def blame(self, sentence: str) -> None:
        if sentence not in self.faults:
            self.faults.append(sentence)


class User(ABC):
    """A user with one stream of random numbers.

    Attributes:
        complaints: words on the terminal that are faults.
        most_pages: the number of pages that the server may have.
    """

    complaints: tuple[str, ...] = ("Traceback",)
    most_pages = 1

    def __init__(self, server: PageServer, found: Findings, random: Random) -> None:
        self.server, self.found, self.random = server, found, random
        self._due = [each for each, _ in self.table()]
        self.random.shuffle(self._due)
        self.once_all = False

    @abstractmethod
    def table(self) -> Sequence[tuple[Callable[[], None], float]]:
        """Returns the actions and their weights."""

    def act(self) -> None:
        """Does an action."""
        if not self._due:
            self.once_all = True
            actions, weights = zip(*self.table(), strict=True)
            self._due = self.random.choices(actions, weights)
        chosen = self._due.pop()
        self.do(chosen)
        self.found.actions[chosen.__name__.strip("_")] += 1

    @abstractmethod
    def do(self, action: Callable[[], None]) -> None:
        """Does an action, which may come too late for the page."""

    @abstractmethod
    def look(self) -> None:
        """Adds the faults of the page."""

    @abstractmethod
    def answers(self) -> bool:
        """Returns whether the page still answers, after the last action."""

    @abstractmethod
    def close(self) -> None:
        """Leaves the page."""


def attack(
    arrive: Callable[[PageServer, Findings], User], scene: str, seconds: float, seed: int, pages: int = 1
) -> Findings:
    """Lets a user act on a new server for a time, with each action at least once. It ends early after a
    fault."""
    found = Findings(seed)
    with StandardError() as terminal:
        server = PageServer(SceneChoice(RunSpec(scene)), port=0, max_sessions=pages, grace=0.2)
        try:
            user, judge = arrive(server, found), Judge(server, found)
            try:
                end = time.monotonic() + seconds
                while (time.monotonic() < end or not user.once_all) and not found.faults:
                    user.act()
                    judge.look(user, terminal.read())
                if not found.faults and not user.answers():
                    found.blame("the page does not answer any more")
                judge.look(user, terminal.read())
            finally:
                user.close()
        finally:
            server.close()
    return found


class Judge:
    """Judges everything that happened since the last look: the terminal, the simulations, and their rows."""

    def __init__(self, server: PageServer, found: Findings) -> None:
        self.found, self._server = found, server
        self._seen = 0
        self._block: Block | None = None
        self._unbounded: Block | None = None
        self._moved = (time.monotonic(), -1)

    def look(self, user: User, said: str) -> None:
        """Adds all faults. said: everything that was written to standard error so far."""
        for word in user.complaints:
            if word in said:
                self.found.blame("on the terminal: " + said[max(0, said.index(word) - 200) :][:2500])
        user.look()
        for learner in self._server.sessions.learners:
            if learner.failure is not None:
                self.found.blame(f"the simulation: {learner.failure}")
            if learner.ready is not None:
                self.found.scenes[learner.choice.run.scene] = None
            if learner.lecture is not None:
                self.found.lessons[learner.lecture.exercise.lesson] = None
        for learner in self._server.sessions.learners[:1]:
            learner.read(lambda block, history: self._judge(learner, block, history))  # noqa: B023
            self._is_alive(learner)

    def _judge(self, learner: SimulationClient, block: Block, history: History) -> None:
        if block is not self._block:
            self._block, self._seen = block, 0
        start, rows = block.since(self._seen)
        self._seen = start + len(rows)
        self.found.rows += len(rows)
        if not len(rows):
            return
        fields, settings, where = history.layout.fields, learner.settings, _where(learner)
        for name in ("q", "v", "tau"):
            if not np.isfinite(rows[:, fields[name]]).all():
                self.found.blame(f"{name} is not a number in {where}")
        if not isinstance(settings, TorqueSettings):
            return
        # Null-space methods have no bounds: motors without saturation apply any requested torque.
        if settings.controller in UNBOUNDED and not settings.plant.saturate:
            self._unbounded = block
        if self._unbounded is not block:
            tau = rows[:, fields["tau"]]
            beyond = np.fmax(rows[:, fields["tau_lower"]] - tau, tau - rows[:, fields["tau_upper"]])
            if float(np.nanmax(beyond, initial=0.0)) > BOUND:
                self.found.blame(f"torque {np.nanmax(beyond):.3g} N·m beyond its bound in {where}")
        if settings.controller in STRICT:
            leak = float(np.nanmax(rows[:, fields["priority_leak"]], initial=0.0))
            self.found.worst_leak = max(self.found.worst_leak, leak)
            if leak > LEAK:
                self.found.blame(f"leak {leak:.3g} in {where}")

    def _is_alive(self, learner: SimulationClient) -> None:
        status, now = learner.status, time.monotonic()
        ticks = -1 if status is None else status.ticks
        if (status is not None and not status.running) or ticks != self._moved[1]:
            self._moved = (now, ticks)
        if now - self._moved[0] > ANSWER:
            speeds = (
                "" if status is None else f", {status.speed:g} and {status.real_time_factor:.2g} × real time"
            )
            self.found.blame(f"no new tick after tick {ticks} for {ANSWER:g} s in {_where(learner)}{speeds}")


def _where(learner: SimulationClient) -> str:
    ready, settings = learner.ready, learner.settings
    return f"{ready.choice.run.scene if ready else '?'} with {settings.controller if settings else '?'}"


class StandardError:
    """Stores what this process and its children write to standard error, and passes it on."""

    def __enter__(self) -> StandardError:
        self._file = tempfile.TemporaryFile()
        self._before = os.dup(2)
        sys.stderr.flush()
        os.dup2(self._file.fileno(), 2)
        return self

    def read(self) -> str:
        sys.stderr.flush()
        size = os.fstat(self._file.fileno()).st_size
        return os.pread(self._file.fileno(), size, 0).decode(errors="replace")

    def __exit__(self, *_: object) -> None:
        said = self.read()
        os.dup2(self._before, 2)
        os.close(self._before)
        self._file.close()
        sys.stderr.write(said)


class Monkey(User):
    """A user with one tab of a browser."""

    def __init__(self, browser: Browser, server: PageServer, found: Findings) -> None:
        super().__init__(server, found, Random(found.seed))
        # In a smaller window, viser's statistics panel has no canvas to draw on, which a random user
        # finds after some time.
        self.page = open_page(browser, server.link, scale=0.5, rest=SELDOM)
        self.page.set_default_timeout(_PATIENCE)
        self.page.set_default_navigation_timeout(SLOW)
        self.page.on("pageerror", self._hear_error)
        self.page.on("dialog", lambda dialog: dialog.dismiss())

    def table(self) -> Sequence[tuple[Callable[[], None], float]]:
        return (
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
        )

    def do(self, action: Callable[[], None]) -> None:
        # An element may be removed or covered between the check and the click.
        with suppress(Error):
            action()

    def look(self) -> None:
        if not self.answers():
            self.found.blame("the page does not answer")

    def answers(self) -> bool:
        with suppress(Error):
            self.page.evaluate("() => document.title")
            return True
        return False

    def close(self) -> None:
        self.page.context.close()

    def _hear_error(self, error: Error) -> None:
        # Viser's button that saves the picture opens a file dialog, which nobody would close.
        if "showSaveFilePicker" not in error.message:
            self.found.blame(f"the browser: {error}")

    def _one(self, selector: str) -> Locator | None:
        elements = self.page.locator(selector)
        count = elements.count()
        return elements.nth(self.random.randrange(count)) if count else None

    def _click_one(self, selector: str) -> bool:
        element = self._one(selector)
        if element is not None:
            element.click()
        return element is not None

    def _click(self) -> None:
        self._click_one("button:visible:enabled:not([role=tab])")

    def _tab(self) -> None:
        if self.random.random() < 0.5:
            tab(self.page, self.random.choice(_PANELS))
        else:
            self._click_one("button[role=tab]:visible")

    def _type(self) -> None:
        box = self._one("input[type=text]:visible:enabled, input[inputmode]:visible:enabled")
        if box is None:
            return
        number = 10 ** self.random.uniform(-4, 4)
        texts = (f"{number:.4g}", f"{-number:.4g}", "0", "1e9", "nan", "-", "word", "[1, 2]")
        box.fill(self.random.choices(texts, (20, 4, 2, 1, 1, 1, 1, 1))[0])
        box.press("Enter")

    def _toggle(self) -> None:
        self._click_one("input[type=checkbox]:visible:enabled")

    def _choose(self) -> None:
        if self._click_one("input[aria-haspopup=listbox]:visible:enabled"):
            self.page.wait_for_timeout(200)
            self._click_one("[role=option]:visible")

    def _key(self) -> None:
        self.page.keyboard.press(self.random.choice(_HOTKEYS))

    def _drag(self) -> None:
        size = self.page.viewport_size or {"width": 1000, "height": 400}
        x, y = self.random.uniform(0.3, 0.7) * size["width"], self.random.random() * size["height"]
        self.page.mouse.move(x, y)
        self.page.mouse.down()
        for _ in range(4):
            x, y = x + self.random.gauss(0, 80), y + self.random.gauss(0, 80)
            self.page.mouse.move(x, y)
        self.page.mouse.up()

    def _wait(self) -> None:
        self.page.wait_for_timeout(self.random.uniform(50, 1500))

    def _lesson(self) -> None:
        self.page.keyboard.press("l")
        cards = ".mantine-Modal-content button:has-text('·')"
        self.page.locator(cards).first.wait_for(timeout=4 * _PATIENCE)
        self._click_one(cards)

    def _reload(self) -> None:
        load(self.page, self.server.link)


def main(minutes: float = 1.0, seed: int = 0, scene: str = "iiwa14-hold", hostile: bool = False) -> int:
    """Does what the module says."""
    from benchmarks.hostile import HostileUser

    run = (scene, 60.0 * minutes, seed)
    if hostile:
        found = attack(HostileUser, *run, pages=4)
    else:
        with sync_playwright() as playwright:
            browser = playwright.chromium.launch(executable_path=find_chromium(), args=CHROMIUM_ARGS)
            found = attack(lambda server, found: Monkey(browser, server, found), *run)
            browser.close()
    told = vars(found) | {"scenes": list(found.scenes), "lessons": list(found.lessons)}
    print(json.dumps(told, indent=1))
    return 1 if found.faults else 0


if __name__ == "__main__":
    sys.exit(tyro.cli(main, description=__doc__))
