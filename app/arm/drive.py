"""Drives an arm and watches it: starts the loop in a separate process, reads the loop's rows and sends it
orders."""

from __future__ import annotations

import contextlib
import multiprocessing
import os
import signal
import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from app.arm.audience import Audience
from app.arm.bounded import STUCK, Bounded
from app.arm.guard import Tolerances
from app.arm.loop import ASKED, Columns, Ended, run
from app.arm.model import Model
from app.arm.orders import Order, Orders
from app.link.ring import Block
from himpc.export.native import NativeController
from robots.arms.arm import Arm, ArmLimits

Array = NDArray[np.float64]

_LOOK = 0.02
"""Time, s, between two readings of the loop's rows."""
_AT_ONCE = 100  # largest number of rows in one reading
_PRIORITY = 50
_PATIENCE = 4.0
"""Time, s, within which a loop must end after a request; it needs at most 2 s."""


class Drag(NamedTuple):
    """A target that is dragged at a time (s after the start)."""

    t: float
    order: Order


@dataclass(frozen=True, eq=False)
class Drive:
    """The plan of a drive.

    Attributes:
        arm: creates the arm; called in the process of the loop.
        controller: creates a controller from the exported kernel.
        limits: the limits in force.
        start: (n,) rad, the arm's joint positions at the start.
        period: the control period, s.
        duration: the length of the drive, s.
        drags: the drags, in the order of their times.
        tolerances: see `ArmGuard` and `Tolerances.distance`.
        delay: see `run`.
        stuck: see `Bounded`.
    """

    arm: Callable[[], Arm]
    controller: Callable[[], NativeController]
    limits: ArmLimits
    start: Array
    period: float
    duration: float
    drags: Sequence[Drag] = ()
    tolerances: Tolerances = field(default_factory=Tolerances)
    delay: int = 0
    stuck: float = STUCK


class Driven(NamedTuple):
    """The result of a drive.

    Attributes:
        why: the reason for its end.
        wanted: whether it ended normally: the time was over, or somebody stopped it.
        gently: whether the arm came to rest under control.
        rows: the rows of the loop, (k, Columns.width).
        q_model, tau_model: the model's values at these rows, (k, n) rad and N·m (without gravity).
    """

    why: str
    wanted: bool
    gently: bool
    rows: Array
    q_model: Array
    tau_model: Array


def drive(
    plan: Drive, model: Model, tell: Callable[[str], None] = print, audience: Audience | None = None
) -> Driven:
    """Drives the arm for a time, or until something ends it. An interrupt from the keyboard stops the arm
    gently, and the drive returns.

    Args:
        plan: the plan of the drive.
        model: the simulated robot beside the arm.
        tell: called with a sentence about each event.
        audience: a page, if there is one.
    """
    watcher = _Watcher(plan, model, tell, audience)
    try:
        watcher.watch()
    except KeyboardInterrupt:
        watcher.ask("it was interrupted", True)
    except BaseException:
        watcher.ask("the watcher failed")
        watcher.wait()
        raise
    watcher.wait()
    return watcher.result()


class _Watcher:
    """Watches the loop and stores the state of the drive."""

    def __init__(
        self, plan: Drive, model: Model, tell: Callable[[str], None], audience: Audience | None
    ) -> None:
        self._plan, self._model, self._tell, self._audience = plan, model, tell, audience
        controller = plan.controller()
        self._at = Columns.of(controller.n, controller.view("error").size)
        self._orders = Orders(len(controller.manifest["tasks"]))
        self._block = Block(self._at.width, controller.n + 1)
        self._asked: str | None = None
        self._wanted = False
        self._given: list[Order] = []
        self._applied = 0
        self._rows: list[tuple[Array, Array, Array]] = []
        self._count = 0
        self._behind = False
        self._ended: Ended | None = None
        self._first: float | None = None
        self._said = 1.0
        self._pipe, self._child = _started(plan, controller, self._orders, self._block)

    def watch(self) -> None:
        """Watches the loop until it has ended."""
        drags = list(self._plan.drags)
        while self._child.is_alive():
            self._orders.beat()
            over = self._pipe.poll(0.0 if self._behind else _LOOK)
            t = self._look()
            while drags and drags[0].t <= t:
                self._give(drags.pop(0).order)
            self._attend()
            if t >= self._plan.duration:
                self.ask(f"the {self._plan.duration:g} s are over", True)
            if over:
                break

    def _attend(self) -> None:
        """Performs the requests of the audience."""
        if self._audience is None:
            return
        for order in self._audience.look():
            self._give(order)
        wish = self._audience.wish()
        if wish is not None:
            self.ask(wish, True)

    def ask(self, why: str, wanted: bool = False) -> None:
        """Asks the loop to end gently. wanted: whether this is a normal end, without a fault."""
        if self._asked is None:
            self._asked, self._wanted = why, wanted
            self._orders.stop()

    def wait(self) -> None:
        """Waits for the end of the loop's process, and reads the remaining rows."""
        until = time.monotonic() + _PATIENCE
        while self._child.is_alive() and time.monotonic() < until:
            self._orders.beat()
            self._child.join(_LOOK)
            self._look()
            if self._audience is not None:
                self._audience.look()
        with contextlib.suppress(EOFError):
            if self._pipe.poll():
                self._ended = self._pipe.recv()
        if self._child.is_alive():
            self._child.kill()
            self._child.join()
        self._look()
        while self._behind:
            self._look()

    def result(self) -> Driven:
        n = len(self._plan.start)
        ended = self._ended
        if ended is None:
            code = self._child.exitcode
            ended = Ended(f"the process of the loop ended (exit code {code})", False, len(self._rows))
        ours = self._asked is not None and ended.why == ASKED
        why = self._asked if self._asked is not None and ours else ended.why
        width = (self._at.width, n, n)
        rows, q, tau = (np.array([each[k] for each in self._rows]).reshape(-1, width[k]) for k in range(3))
        return Driven(why, ours and self._wanted, ended.gently, rows, q, tau)

    def _give(self, order: Order) -> None:
        self._orders.drag(order)
        self._given.append(order)
        if self._audience is not None:
            self._audience.given(order)

    def _look(self) -> float:
        """Reads the new rows and advances the model to the time of each row; returns the time from the
        first row to the last, s."""
        first, rows = self._block.since(self._count)
        self._behind = len(rows) > _AT_ONCE
        for place, row in enumerate(rows[:_AT_ONCE]):
            self._orders.beat()
            self._beside(row)
            self._count = first + place + 1
        return 0.0 if self._first is None else float(self._rows[-1][0][self._at.t]) - self._first

    def _beside(self, row: Array) -> None:
        """Advances the model to the time of a row, and compares it with the arm."""
        at, model = self._at, self._model
        if self._first is None:
            self._first = float(row[at.t])
            self._tell("the loop controls the arm")
        t = float(row[at.t]) - self._first
        while self._applied < min(int(row[at.orders]), len(self._given)):
            model.take(self._given[self._applied])
            self._applied += 1
        if not row[at.ending]:
            model.follow(t)
            away = np.abs(row[at.q] - model.q)
            if not away.max() <= self._plan.tolerances.distance:
                joint = int(np.argmax(away))
                self.ask(f"joint {joint + 1} is {away[joint]:.2f} rad away from the model")
        self._rows.append((row, model.q, model.tau))
        if self._audience is not None:
            self._audience.see(t, row, model)
        if t >= self._said:
            self._said += 1.0
            self._say(t)

    def _say(self, t: float) -> None:
        at, last = self._at, np.array([each[0] for each in self._rows[-1000:]])
        self._tell(
            f"{t:6.1f} s  missed {int(last[:, at.missed].sum())} of the last second's periods, "
            f"{np.abs(last[-1, at.q] - self._model.q).max():.4f} rad from the model, "
            f"largest torque {np.abs(last[:, at.tau]).max():.1f} N m, "
            f"controller {np.median(last[:, at.us]):.0f} us, longest {last[:, at.us].max():.0f} us"
        )


def _started(plan: Drive, controller: NativeController, orders: Orders, block: Block) -> tuple[Any, Any]:
    """Starts the process of the loop. Returns the connection on which the process reports its end, and the
    process."""
    ours, theirs = multiprocessing.Pipe(duplex=False)
    fork = multiprocessing.get_context("fork")  # the child shares the memory and the imported modules
    child = fork.Process(target=_work, args=(plan, controller, orders, block, theirs), daemon=False)
    child.start()
    theirs.close()
    return ours, child


def hurry(priority: int) -> None:
    """Requests real-time scheduling for this process; does nothing if the system forbids it."""
    with contextlib.suppress(OSError, AttributeError):
        os.sched_setscheduler(0, os.SCHED_FIFO, os.sched_param(priority))


def _work(plan: Drive, controller: NativeController, orders: Orders, block: Block, pipe: Any) -> None:
    """The process of the loop. It ignores interrupts, because the watcher gets them and asks the loop to
    end gently."""
    signal.set_wakeup_fd(-1)
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, lambda *_: orders.stop())
    hurry(_PRIORITY)
    try:
        arm = Bounded(plan.arm(), plan.stuck)
        ended = run(
            arm, controller, plan.limits, plan.start, orders, block, plan.tolerances, plan.period, plan.delay
        )
    except Exception as error:
        ended = Ended(f"the loop failed: {error}", False, block.count)
    with contextlib.suppress(OSError):
        pipe.send(ended)
