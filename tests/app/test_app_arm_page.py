"""The page of an arm, with an arm in MuJoCo: it shows the measured arm and its simulation as ghost, and the
loop never waits for it."""

from __future__ import annotations

import multiprocessing
import os
import signal
import socket
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from arm_bench import PATIENT, T_S, Bench, Scripted

from app.arm.drive import Drive, Driven, drive
from app.arm.guard import Tolerances
from app.arm.loop import Columns
from app.arm.model import Model
from app.arm.prepared import nominal, prepared
from app.arm.shown import DEAF, GONE, LEFT, ONLY_TARGETS, PRESSED, STOPPED, Shown
from app.client.moment import moment_of
from app.client.simulation_client import ARM_AGAIN, ARM_GHOST, SimulationClient
from app.link.children import forked_here
from app.link.choice import SceneChoice
from app.link.forkserver import ForkServer
from app.link.messages import ArmView, Begin, PageLeft, Play, Post, Quit, Status, StepTicks
from app.link.process import Process, wait_until
from app.link.spares import Spares
from app.link.wire import Wire
from app.server.sessions import WORKER
from app.worker.ghost import GhostBody
from lessons.events import MoveTarget, Reset, Set
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Ghost
from robots.arms.simulated_arm import SimulatedArm
from robots.processes.isolation import waited

CHOICE = SceneChoice(RunSpec("panda-hold"))
LONG = 60.0  # s


def plan_of(
    bench: Bench,
    happen: Callable[[int, Scripted], None] = lambda k, arm: None,
    tolerances: Tolerances = PATIENT,
    wait: float = T_S,
) -> tuple[Drive, Model]:
    arm = lambda: Scripted(bench.plant(), happen, wait)  # noqa: E731
    plan = Drive(arm, bench.make, bench.ready.limits, bench.scene.q_0, T_S, 600.0, tolerances=tolerances)
    return plan, Model(bench.plant(), bench.make(), bench.ready.limits, T_S)


def watched(bench: Bench, wire: Wire) -> None:
    """Does the work of the process that watches an arm."""
    plan, model = plan_of(bench)
    shown = Shown(wire, CHOICE, bench.prepared(bench.scene), T_S)
    if shown.wait_for_start():
        shown.stay(drive(plan, model, lambda text: None, shown))


@pytest.fixture
def page(bench: Bench, fork_server: ForkServer | None) -> Iterator[SimulationClient]:
    """Yields the page's client of an arm. The arm waits for *Run*."""
    arm = Process(partial(forked_here, partial(watched, bench)))
    spares = Spares(WORKER, fork_server)
    made = SimulationClient("", CHOICE, spares, arm)
    yield made
    arm.send(Quit())
    assert wait_until(lambda: not arm.alive, LONG)
    made.close()
    spares.close()


def told(page: SimulationClient) -> Status:
    assert page.status is not None
    return page.status


def arm_of(page: SimulationClient) -> ArmView:
    found = told(page).arm
    assert found is not None
    return found


def test_the_simulation_is_the_ghost_of_the_arm(page: SimulationClient, bench: Bench) -> None:
    """A dragged target moves the measured robot and its simulation; both have errors to draw, at the same
    time. *Stop gently* stops the arm, and the page gives the reason."""
    assert wait_until(lambda: page.status is not None, LONG)
    assert not told(page).running
    ghost = page.ghost
    assert ghost is not None
    assert wait_until(lambda: ghost.status is not None, LONG)
    page.send(Play(True))
    assert wait_until(lambda: told(page).t > 0.1, LONG)
    target = bench.order(0.0, 0.05, 0.02).values
    page.send(Post(MoveTarget("position", tuple(target.tolist()))))
    assert wait_until(lambda: np.array_equal(told(page).targets["position"], target), LONG)

    def both() -> bool:
        now = moment_of(page, None)
        if now is None or now.ghost is None:
            return False
        return all(np.abs(each[-1, :3] - target).max() < 1e-4 for each in (now.poses, now.ghost.poses))

    assert wait_until(both, LONG)
    now = moment_of(page, None)
    assert now is not None and now.ghost is not None and page.ready is not None
    columns = page.ready.layout.fields["error/position"]
    first, second = (np.linalg.norm(each.columns(columns), axis=1) for each in (now.window, now.ghost.window))
    assert 2e-3 < np.nanmax(first) < 0.05
    assert np.nanmax(np.abs(first - second)) < 2e-3
    fields = page.ready.layout.fields
    assert np.abs(now.latest[fields["x_d/position"]] - target).max() < 1e-4
    assert np.abs(now.latest[fields["tau"]]).max() < 1.0, "gravity is in it"
    page.send(Play(False))
    assert wait_until(lambda: arm_of(page).ended != "", LONG)
    assert arm_of(page).ended == PRESSED
    assert arm_of(page).missed == 0
    assert not told(page).running
    page.send(Play(True))
    assert wait_until(lambda: STOPPED in page.take_messages()[1], LONG)


def test_only_targets_of_an_arm_can_be_changed(page: SimulationClient) -> None:
    """Settings, resets, scenes and other ghosts are refused in one sentence each, and no simulation replaces
    the arm."""
    assert wait_until(lambda: page.status is not None, LONG)
    pid, notices = page.pid, list[str]()

    def noticed() -> list[str]:
        notices.extend(page.take_messages()[1])
        return notices

    for command in (Post(Set("horizon", 3)), Post(Reset()), StepTicks()):
        page.send(command)
        assert wait_until(lambda: ONLY_TARGETS in noticed(), LONG)
        notices.clear()
    page.send(Post(MoveTarget("position", (0.0,))))
    assert wait_until(lambda: any("needs 3 numbers" in each for each in noticed()), LONG)
    notices.clear()
    for refused, why in (
        (page.restart, ARM_AGAIN),
        (page.reset_all, ARM_AGAIN),
        (lambda: page.load(SceneChoice(RunSpec("iiwa14-hold"))), ARM_AGAIN),
        (lambda: page.start_ghost(Ghost("other", ("horizon=3",))), ARM_GHOST),
        (page.stop_ghost, ARM_GHOST),
    ):
        refused()
        assert why in noticed()
        notices.clear()
    assert page.pid == pid and page.choice == CHOICE and page.ghost is not None


def test_an_arm_stops_when_its_page_is_closed(page: SimulationClient) -> None:
    assert wait_until(lambda: page.status is not None, LONG)
    page.send(PageLeft())
    page.send(Play(True))
    assert wait_until(lambda: told(page).ticks > 50, LONG)
    page.send(PageLeft())
    assert wait_until(lambda: arm_of(page).ended != "", LONG)
    assert arm_of(page).ended == LEFT


def blocked_counts(k: int, arm: Scripted, last: list[float], periods: int | None) -> None:
    """Counts a period as missed if the loop waited for a long time for another process. The time in which the
    loop waited for a core is not counted."""
    now = time.monotonic() - waited(os.getpid())
    if last and now - last[0] > 0.05:
        arm.skipped += T_S
    last[:] = [now]
    if k == periods:
        os.kill(os.getpid(), signal.SIGTERM)  # asks the loop to end gently


def published(driven: Driven, at: Columns) -> tuple[int, int]:
    """Returns the number of cycles that the loop published before its end, and the number of missed
    periods."""
    rows = driven.rows[driven.rows[:, at.ending] == 0]
    return len(rows), int(rows[:, at.missed].sum())


def test_a_page_that_hangs_delays_nothing(bench: Bench) -> None:
    """The page reads nothing, and its queue is soon full. The loop misses hardly more periods than without a
    page, and after some seconds the arm is stopped gently."""
    at = Columns.of(7, bench.make().view("error").size)
    tolerances = replace(PATIENT, silent=DEAF - 1.0)
    ours, theirs = socket.socketpair()
    theirs.settimeout(10.0)  # otherwise a watcher that waits for the page would hang here
    theirs.setsockopt(socket.SOL_SOCKET, socket.SO_SNDBUF, 8192)
    plan, model = plan_of(bench, partial(blocked_counts, last=[], periods=None), tolerances, 4 * T_S)
    shown = Shown(Wire(theirs), CHOICE, bench.prepared(bench.scene), T_S)
    Wire(ours).send(Play(True))
    assert shown.wait_for_start()
    hung = drive(plan, model, lambda text: None, shown)
    assert hung.why == f"the page has read nothing for {DEAF:g} s"
    assert hung.gently
    cycles, missed = published(hung, at)
    assert cycles > 100
    plan, model = plan_of(bench, partial(blocked_counts, last=[], periods=cycles - 1), tolerances, 4 * T_S)
    cycles_alone, missed_alone = published(drive(plan, model, lambda text: None), at)
    assert cycles == cycles_alone
    assert missed <= missed_alone + 3  # a slow disk may sometimes stop either loop
    ours.close()
    theirs.close()


def test_an_arm_stops_when_its_page_s_program_is_killed(bench: Bench, tmp_path: Path) -> None:
    """If the page's program is killed, the process that watches the arm first stops the arm gently."""
    begun, over = tmp_path / "begun", tmp_path / "over"

    def note(k: int, arm: Scripted) -> None:
        if k == 5:
            begun.touch()

    def watch(wire: Wire) -> None:
        plan, model = plan_of(bench, note)
        shown = Shown(wire, CHOICE, bench.prepared(bench.scene), T_S)
        if shown.wait_for_start():
            driven = drive(plan, model, lambda text: None, shown)
            over.write_text(f"{driven.why}, {driven.gently}")

    def serve() -> None:
        process = Process(partial(forked_here, watch))
        process.send(Play(True))
        time.sleep(LONG)

    server = multiprocessing.get_context("fork").Process(target=serve)
    server.start()
    assert wait_until(begun.exists, LONG)
    server.kill()
    server.join()
    assert wait_until(lambda: over.exists() and over.read_text() != "", LONG)
    assert over.read_text() == f"{GONE}, True"


def test_the_simulation_knows_nothing_of_the_arm_but_where_it_is(bench: Bench) -> None:
    """`--set plant.…` changes the arm only. The ghost begins at rest in the measured pose, and without
    gravity it stays there."""
    loaded = bench.scene
    heavy = replace(loaded.settings, plant=replace(loaded.settings.plant, payload_kg=3.0))
    start = loaded.q_0 + 0.1
    ready = prepared(
        nominal(replace(loaded, settings=heavy), loaded), start, SimulatedArm(bench.plant()).limits, ()
    )
    assert np.abs(ready.plant.holding_torque() - torque_without_a_payload(bench, start)).max() < 1e-9
    ghost = GhostBody(Begin(CHOICE, ready.session.settings, start), ())
    try:
        assert np.array_equal(ghost.body.session.plant.q, start)
        ghost.driver.hear((), 0.05)
        while ghost.catch_up(0.0):
            pass
        assert np.abs(ghost.body.session.plant.q - start).max() < 1e-9
    finally:
        ghost.body.close()


def torque_without_a_payload(bench: Bench, q: np.ndarray) -> np.ndarray:
    """Returns the torque that holds the described arm at q, without a payload."""
    plant = bench.plant()
    plant.reset(q)
    return plant.holding_torque()
