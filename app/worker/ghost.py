"""The process of a ghost: a simulation without its own clock, which runs up to its leader's time."""

from __future__ import annotations

import time
from multiprocessing.connection import Connection
from typing import final

from app.link.messages import Begin, Command, FollowLeader, Loading, LoadRefused, Quit, Reached
from app.link.process import send
from app.worker.simulation import SimulationRunner
from lessons.session.ghost import GhostDriver, ghost_scene
from robots import InputError

_POSES = 1 / 60  # s
_REACHED = 1 / 50  # s
_STATUS = 0.1  # s
_CHUNK = 0.01  # s: the longest run between two checks for commands


@final
class GhostBody:
    """A simulation whose session follows another session."""

    def __init__(self, begin: Begin, own: tuple[str, ...]) -> None:
        """Raises InputError if the scene cannot be loaded, or if `own` contains settings that do not fit the
        scene."""
        scene = ghost_scene(begin.choice.scene(), begin.settings, own)
        # The lesson judges the robot, not its ghost.
        self.body = SimulationRunner(begin.choice, scene, judged=False)
        self.driver = GhostDriver(self.body.session, begin.settings, own)

    def catch_up(self, until: float) -> bool:
        """Runs all steps that are due, but stops at the time `until` of `perf_counter`; returns whether it
        ran any step."""
        ran = False
        while self.driver.due and (not ran or time.perf_counter() < until):
            self.body.tick()
            self.driver.take()
            ran = True
        return ran


def follow(page: Connection, first: FollowLeader) -> None:
    """Follows the leader until the page sends Quit; `first` is the message that started this process."""
    ghost = _hear(page, None, first)
    next_pose = next_reached = next_status = 0.0
    reached = -1.0
    try:
        while True:
            while page.poll(None if ghost is None else 0.0):
                command: Command = page.recv()
                if isinstance(command, Quit):
                    return
                if isinstance(command, FollowLeader):
                    ghost = _hear(page, ghost, command)
                    if command.script.begin is not None:
                        reached = -1.0  # the leader waits for the report that the ghost has started
            if ghost is None:
                continue
            ran = ghost.catch_up(time.perf_counter() + _CHUNK)
            news = ghost.body.news()
            if news is not None:
                send(page, news)
            now = time.perf_counter()
            if now >= next_pose:
                ghost.body.write_poses()
                next_pose = now + _POSES
            t = ghost.body.session.t
            if t != reached and now >= next_reached:
                send(page, Reached(t))
                reached, next_reached = t, now + _REACHED
            if now >= next_status:
                send(page, ghost.body.status())
                next_status = now + _STATUS
            if not ran:
                page.poll(_POSES)
    finally:
        if ghost is not None:
            ghost.body.block.close()


def _hear(page: Connection, ghost: GhostBody | None, command: FollowLeader) -> GhostBody | None:
    script = command.script
    if script.begin is not None:
        send(page, Loading())
        if ghost is not None:
            ghost.body.block.close()
        try:
            ghost = GhostBody(script.begin, command.own)
        except InputError as error:
            send(page, LoadRefused(str(error)))
            return None
        send(page, ghost.body.ready())
    if ghost is not None:
        ghost.driver.hear(script.events, script.t)
    return ghost
