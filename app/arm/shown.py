"""Connects an arm with its page: receives commands, sends rows, poses and reports, and never waits."""

from __future__ import annotations

import os
import time
from dataclasses import replace
from typing import final

import numpy as np
from numpy.typing import NDArray

from app.arm.drags import KINDS, order_to
from app.arm.drive import Driven
from app.arm.loop import Columns
from app.arm.model import Model
from app.arm.orders import Order
from app.arm.page_rows import PageRows
from app.arm.prepared import Prepared
from app.link.choice import SceneChoice
from app.link.messages import (
    ArmView,
    Begin,
    Command,
    Lead,
    Load,
    LoadRefused,
    PageLeft,
    Play,
    Post,
    Quit,
    Ready,
    Script,
    Speed,
    Status,
    StepTicks,
    TaskView,
    Tell,
    Told,
    WaitAt,
)
from app.link.wire import Wire
from app.worker.outlet import Outlet
from app.worker.reports.torque import TorqueRun
from lessons.events import Event, MoveTarget

Array = NDArray[np.float64]

_STATUS = 0.1  # s
_SCRIPT = 0.02  # s
_LOOK = 0.05  # s between two readings of the page's commands while no arm is driven
_AHEAD = 0.5  # s
_MOST = 64  # commands of a page in one reading
DEAF = 3.0
"""Time, s, for which the page may read nothing; after that the arm is stopped."""
ONLY_TARGETS = (
    "On an arm, only targets can be moved. The settings are those with which himpc-lab arm was started."
)
STOPPED = "The arm was stopped: start himpc-lab arm again."
PRESSED, LEFT, GONE = "Stop gently was pressed", "the page was closed", "the page's program has ended"


@final
class Shown:
    """Connects a drive with its page, see `app.arm.audience.Audience`."""

    def __init__(self, wire: Wire, choice: SceneChoice, ready: Prepared, period: float) -> None:
        """wire: the connection to the page; choice: the run that the page shows; period: the control period,
        s."""
        self._wire, self._choice, self._image = wire, choice, ready.image
        self._session, self._start = ready.session, np.array(ready.plant.q)
        self._run, self._outlet = TorqueRun(ready.session), Outlet(ready.session)
        robot, layout, manifest = ready.session.robot, ready.session.layout, ready.image.manifest
        self._rows = PageRows(layout, manifest, robot, ready.limits, period)
        self._names = {task["index"]: task["name"] for task in manifest["tasks"]}
        self._movable = {task["name"] for task in manifest["tasks"] if task["target"] in KINDS}
        self._at = Columns.of(robot.n, sum(task["rows"] for task in manifest["tasks"]))
        self._late = 1e6 * period
        self._parent = os.getppid()
        self._begun, self._there = False, True
        self._wish: str | None = None
        self._ended = ""
        self._orders: list[Order] = []
        self._given: list[Order] = []
        self._log: list[tuple[float, Event]] = []
        self._told = 0
        self._leading: Begin | None = None
        self._leads = False
        self._notices: list[str] = []
        self._t, self._q = 0.0, self._start
        self._ticks = self._missed = self._over_budget = 0
        self._settings_told = False
        self._next_status = self._next_script = 0.0
        self._script_t, self._reached = -1.0, 0.0
        self._heard_at = time.monotonic()
        self._outlet.write_poses(ready.session)

    # ---------------------------------------------------------------- before and after the drive

    def wait_for_start(self) -> bool:
        """Waits until Run is pressed on the page; returns False if the program ended before that."""
        while self._there and not self._begun and self._wish is None:
            self._wire.poll(_LOOK)
            self._attend()
        return self._begun and self._wish is None

    def stay(self, driven: Driven) -> None:
        """Shows the reason why the drive ended, until the page's program ends."""
        rest = "" if driven.gently else "; it did not come to rest under control"
        self._ended = driven.why + rest
        while self._there:
            self._wire.poll(_LOOK)
            self._attend()

    def interrupt(self) -> None:
        """Called when the program was interrupted in its terminal."""
        self._wish = self._wish or "it was interrupted"

    # ---------------------------------------------------------------- an audience

    def look(self) -> list[Order]:
        self._attend()
        orders, self._orders = self._orders, []
        return orders

    def wish(self) -> str | None:
        return self._wish

    def given(self, order: Order) -> None:
        self._given.append(order)

    def see(self, t: float, row: Array, model: Model) -> None:
        self._outlet.block.write(self._rows.of(t, row, model))
        taken = int(row[self._at.orders])
        for order in self._given[len(self._log) : taken]:
            event = MoveTarget(self._names[order.task], tuple(order.values.tolist()))
            self._move(event)
            self._log.append((t, event))
        self._t, self._q = t, row[self._at.q]
        self._ticks += 1
        self._missed += int(row[self._at.missed])
        self._over_budget += bool(row[self._at.us] > self._late)

    # ---------------------------------------------------------------- the page

    def _attend(self) -> None:
        """Receives the commands of the page, and sends the reports that are due."""
        for _ in range(_MOST):
            if not self._there or not self._wire.poll():
                break
            try:
                self._hear(self._wire.recv())
            except (EOFError, OSError):
                self._there = False
        if os.getppid() != self._parent:
            self._there = False
        if not self._there:
            self._wish = self._wish or GONE
            return
        try:
            self._tell()
        except OSError:
            self._there = False

    def _hear(self, command: Command) -> None:
        match command:
            case Post(MoveTarget() as event, also):
                for each in (event, *also):
                    self._drag(each)
            case Play(True) if not self._begun:
                self._begun = True
            case Play(True):
                self._notices.append(STOPPED if self._wish or self._ended else ONLY_TARGETS)
            case Play(False) if self._begun:
                self._wish = self._wish or PRESSED
            case PageLeft() if self._begun:
                self._wish = self._wish or LEFT
            case Quit():
                self._wish, self._there = self._wish or LEFT, False
            case Load(choice) if choice == self._choice:
                self._wire.send(self._ready())
            case Load():
                self._wire.send(LoadRefused(ONLY_TARGETS))
            case Lead(True):
                self._leads, self._told = True, 0
                self._leading = Begin(self._choice, self._session.settings, self._start)
            case WaitAt(until):
                self._reached = until  # stored only: an arm does not wait for its ghost
            case Tell():
                self._wire.send(Told(self._choice, self._session.settings, tuple(self._log), self._t))
            case Post() | StepTicks() | Speed():
                self._notices.append(ONLY_TARGETS)
            case _:
                pass

    def _drag(self, event: MoveTarget) -> None:
        if event.task not in self._movable:
            self._notices.append(f"The target of task '{event.task}' cannot be moved on an arm.")
            return
        if self._move(event) and not self._ended:
            order = order_to(self._session, self._image.manifest, event.task)
            assert order is not None
            self._orders.append(order)

    def _move(self, event: MoveTarget) -> bool:
        """Moves the session's target; returns whether it could be moved."""
        self._session.post(event)
        self._session.drain()
        refused, self._session.notices[:] = list(self._session.notices), []
        self._notices += refused
        return not refused

    def _tell(self) -> None:
        now = time.monotonic()
        if not self._wire.takes():
            if self._begun and now - self._heard_at > DEAF:
                self._wish = self._wish or f"the page has read nothing for {DEAF:g} s"
            return
        self._heard_at = now
        poses = self._outlet.poses.at(self._q)
        if poses is not None:
            self._outlet.block.write_poses(poses, self._t)
        if self._leads and now >= self._next_script and (self._leading or self._follows):
            begin, self._leading = self._leading, None
            events, self._told = tuple(self._log[self._told :]), len(self._log)
            self._wire.send(Script(events, self._t, begin))
            self._next_script, self._script_t = now + _SCRIPT, self._t
        if now >= self._next_status:
            self._wire.send(self._status())
            self._next_status = now + _STATUS

    @property
    def _follows(self) -> bool:
        """Whether to send the ghost a new script: time has passed, and the ghost has nearly reached the end
        of the last script. More scripts would fill the command queue of a ghost that is late."""
        return self._t != self._script_t and self._script_t < self._reached + _AHEAD

    def _tasks(self) -> tuple[TaskView, ...]:
        return tuple(
            each if each.name in self._movable else replace(each, raw=None) for each in self._run.tasks()
        )

    def _ready(self) -> Ready:
        session = self._session
        self._settings_told = False
        return Ready(
            choice=self._choice,
            block=self._outlet.block.handle,
            robot=session.robot,
            layout=session.layout,
            settings=session.settings,
            tasks=self._tasks(),
            room=self._run.room(),
            world=self._run.world(),
            arm=True,
        )

    def _status(self) -> Status:
        told, self._settings_told = self._settings_told, True
        notices, self._notices = tuple(self._notices[-3:]), []
        running = self._begun and not self._ended
        return Status(
            t=self._t,
            ticks=self._ticks,
            running=running,
            speed=1.0,
            real_time_factor=1.0 if running else 0.0,
            capped=False,
            over_budget=self._over_budget,
            late=self._missed,
            resets=1,
            targets={name: raw for name, raw in self._run.targets().items() if name in self._movable},
            path=np.zeros((0, 3)),
            binding=(),
            notices=notices,
            settings=None if told else self._session.settings,
            arm=ArmView(self._missed, self._begun, self._ended, max(0.0, self._t - self._reached)),
        )
