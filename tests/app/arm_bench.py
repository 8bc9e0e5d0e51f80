"""An arm in MuJoCo that follows the script of a test, and a scene prepared for drives."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from app.arm.bounded import STUCK
from app.arm.drive import Drag, Drive, Driven, drive
from app.arm.guard import Tolerances
from app.arm.loop import Columns, Ended, run
from app.arm.model import Model
from app.arm.orders import Order, Orders
from app.arm.prepared import Prepared, maker, prepared
from app.link.ring import Block
from himpc.export.native import build
from lessons.scenes.catalog import torque_scene
from lessons.scenes.torque_scene import TorqueScene
from robots import Plant, PlantSettings
from robots.arms.arm import Arm, Reading
from robots.arms.simulated_arm import SimulatedArm
from tests.commands.exported import needed

T_S = 1e-3
PATIENT = Tolerances(silent=60.0)
"""Tolerances for a watcher that a busy machine may delay."""
ALONE = Tolerances()


class Scripted(Arm):
    """A simulated arm that calls `happen` at each period; `shown` changes the state that it reports."""

    def __init__(self, plant: Plant, happen: Callable[[int, Scripted], None], wait: float = 0.0) -> None:
        """wait: duration of every read, s. Each read simulates one period, also on a busy machine."""
        self.inner, self.wait = SimulatedArm(plant, T_S, in_step=False), wait
        self.limits, self.plant = self.inner.limits, plant
        self.happen, self.reads, self.skipped = happen, 0, 0.0
        self.written = np.zeros(plant.n)
        self.shown: Callable[[Reading], Reading] = lambda reading: reading
        self.stopped = False

    def read(self) -> Reading:
        self.happen(self.reads, self)
        self.reads += 1
        time.sleep(self.wait)
        reading = self.inner.read()
        return self.shown(reading._replace(t=reading.t + self.skipped))

    def write(self, tau: np.ndarray) -> None:
        self.inner.write(tau)
        self.written = tau

    def stop(self) -> None:
        self.stopped = True
        self.inner.stop()


class Bench:
    """A scene prepared for drives, with its library."""

    def __init__(self, folder: Path) -> None:
        needed("cc")
        self.scene = torque_scene("panda-hold")
        self.settings = PlantSettings()  # a simulation without contacts is faster
        self.ready = self.prepared(self.scene)
        self.make = maker(build(folder), self.ready.image)

    def prepared(self, scene: TorqueScene) -> Prepared:
        arm = SimulatedArm(self.plant())
        return prepared(scene, scene.q_0, arm.limits, ())

    def plant(self, **changes: Any) -> Plant:
        plant = Plant(self.scene.robot, replace(self.settings, **changes), T_S)
        plant.reset(self.scene.q_0)
        return plant

    def run(
        self,
        happen: Callable[[int, Scripted], None] = lambda k, arm: None,
        periods: int = 600,
        drags: dict[int, Order] | None = None,
        plant: Plant | None = None,
        shown: Callable[[Reading], Reading] | None = None,
        delay: int = 0,
    ) -> tuple[Ended, np.ndarray, Columns, Scripted]:
        """Runs the loop in this process, one period per read. drags: the orders, by the number of their
        period; periods: the number of periods after which the loop is asked to end."""
        controller = self.make()
        orders, at = Orders(4), Columns.of(7, controller.view("error").size)
        block = Block(at.width, 8)

        def each(k: int, arm: Scripted) -> None:
            orders.beat()
            if drags and k in drags:
                orders.drag(drags[k])
            if k == periods:
                orders.stop()
            happen(k, arm)

        arm = Scripted(plant or self.plant(), each)
        arm.shown = shown or arm.shown
        ended = run(
            arm, controller, self.ready.limits, self.scene.q_0, orders, block, Tolerances(), T_S, delay
        )
        _, rows = block.since(0)
        assert len(rows) == ended.rows
        return ended, rows, at, arm

    def drive(
        self,
        happen: Callable[[int, Scripted], None] = lambda k, arm: None,
        tell: Callable[[str], None] = lambda text: None,
        duration: float = 0.3,
        drags: tuple[Drag, ...] = (),
        tolerances: Tolerances = PATIENT,
        elsewhere: float = 0.0,
    ) -> Driven:
        """Runs a drive with the loop in a process of its own. elsewhere: offset of joint 2 of the model,
        rad."""
        beside = self.plant()
        beside.reset(self.scene.q_0 + elsewhere * np.eye(7)[1])
        wanted = self.wanted(lambda: Scripted(self.plant(), happen, T_S), duration, drags, tolerances)
        return drive(wanted, Model(beside, self.make(), self.ready.limits, T_S), tell)

    def wanted(
        self,
        arm: Callable[[], Scripted],
        duration: float = 60.0,
        drags: tuple[Drag, ...] = (),
        tolerances: Tolerances = PATIENT,
        stuck: float = STUCK,
    ) -> Drive:
        """Returns a drive of this scene with an arm that the test supplies."""
        q_0 = self.scene.q_0
        return Drive(arm, self.make, self.ready.limits, q_0, T_S, duration, drags, tolerances, stuck=stuck)

    def model(self) -> Model:
        """Returns the model that is simulated beside the arm."""
        return Model(self.plant(), self.make(), self.ready.limits, T_S)

    def order(self, *moved: float) -> Order:
        """Returns an order that moves the hand's target by `moved`, m."""
        (task,) = (each for each in self.ready.image.manifest["tasks"] if each["name"] == "position")
        _, position = self.plant().frame_pose(self.scene.robot.tip)
        return Order(task["index"], position + np.array(moved))
