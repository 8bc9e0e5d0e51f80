"""Measures the computing time of contacts, and how deep and how still a robot rests on its floor.

    python benchmarks/contacts.py cost [TICKS]
    python benchmarks/contacts.py press [SECONDS]

`cost` runs each scene in three sessions, tick by tick in turn: without contacts, with contacts while nothing
is touched, and with a robot that presses on the floor. It prints the medians of a whole tick (control and
plant) and of the plant alone in microseconds, and the ratio of the ticks. A tick of a robot that presses also
contains the time that the controller needs for its active limits. `press` lets each arm fall on its floor
without torque. For several time constants of the contact and steps of the plant, it prints the deepest
penetration in the fall and at rest, mm, and the largest joint speed at rest, rad/s.
"""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from time import perf_counter_ns

import numpy as np

from lessons.events import MoveTarget
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession
from robots import Plant, PlantSettings, Robot, load_robot
from robots.floor import standing_floor
from robots.mechanics import model

LOW = {
    "iiwa14-hold": ("position", (0.6, 0.1, -0.3)),
    "panda-hold": ("position", (0.55, 0.1, -0.15)),
    "baxter-hold": ("right", (0.1, -0.3, 0.8)),  # in the robot's chest, because it cannot reach the floor
}
"""Targets that lie inside the floor or the robot."""
BENT = {"iiwa14": (0, 60, 0, -30, 0, 30, 0), "panda": (0, 60, 0, -60, 0, 90, 45)}
"""Postures from which the arms fall on the floor, degrees."""


def cost(ticks: int) -> dict[str, dict[str, float]]:
    """Returns medians over the ticks of three sessions that run side by side. The pressing session counts
    only while it touches something."""
    found = {}
    for name, (task, place) in LOW.items():
        scene = torque_scene(name)
        off = replace(scene.settings, plant=replace(scene.settings.plant, contacts=False, joint_stops=False))
        sessions = {
            "off": TorqueSession(replace(scene, settings=off)),
            "on, nothing touched": TorqueSession(scene),
            "on, pressing": TorqueSession(replace(scene, events=((0.0, MoveTarget(task, place)),))),
        }
        pressing = sessions["on, pressing"]
        waited = 0
        while pressing.plant.touch.force == 0.0 and waited < 4000:
            pressing.tick()
            waited += 1
        spent: dict[str, list[float]] = {key: [] for key in sessions}
        plant: dict[str, list[float]] = {key: [] for key in sessions}
        steps = {key: timed(session.plant) for key, session in sessions.items()}
        for _ in range(ticks):
            for key, session in sessions.items():
                started = perf_counter_ns()
                session.tick()
                tick = 1e-3 * (perf_counter_ns() - started)
                if key != "on, pressing" or session.plant.touch.force > 0.0:
                    spent[key].append(tick)
                    plant[key].append(steps[key][-1])
        medians = {key: float(np.median(times)) for key, times in spent.items()}
        ratios = {f"{key} / off": medians[key] / medians["off"] for key in medians if key != "off"}
        plants = {f"plant, {key}": float(np.median(times)) for key, times in plant.items()}
        found[name] = {**medians, **ratios, **plants, "ticks in contact": len(spent["on, pressing"])}
    return found


def timed(plant: Plant) -> list[float]:
    """Returns the list to which the plant will append the time of each of its steps, µs."""
    times: list[float] = []
    step = plant.step

    def measured(tau: np.ndarray, period: float) -> np.ndarray:
        started = perf_counter_ns()
        found = step(tau, period)
        times.append(1e-3 * (perf_counter_ns() - started))
        return found

    plant.step = measured  # pyright: ignore[reportAttributeAccessIssue]
    return times


def press(seconds: float) -> list[dict[str, object]]:
    """Lets each arm fall on its floor, with viscous friction, for several time constants of the contact and
    several steps of the plant. Returns the results."""
    found: list[dict[str, object]] = []
    for name in BENT:
        robot = load_robot(name)
        for timestep in (2e-3, 1e-3, 5e-4):
            for constant in (0.002, 0.004, 0.008, 0.02):
                model.CONTACT_SOLREF = (constant, 1.0)
                rest = fall(robot, np.radians(BENT[name]), timestep, seconds)
                found.append({"robot": name, "timestep": timestep, "time constant": constant, **rest})
    return found


def fall(robot: Robot, start: np.ndarray, timestep: float, seconds: float) -> dict[str, object]:
    """Returns the results of one fall."""
    plant = Plant(
        robot, PlantSettings(contacts=True, joint_stops=True, damping=2.0), timestep, standing_floor(robot)
    )
    plant.reset(start, tau=np.zeros(robot.n))
    depth, speed, at_rest = 0.0, 0.0, 0.0
    for k in range(round(seconds / timestep)):
        plant.step(np.zeros(robot.n), timestep)
        depth = max(depth, plant.touch.depth)
        if k * timestep > seconds - 0.3:
            speed, at_rest = max(speed, float(np.abs(plant.v).max())), max(at_rest, plant.touch.depth)
    rounded = {"fall_mm": 1e3 * depth, "rest_mm": 1e3 * at_rest, "rest_speed": speed}
    return {**{key: round(value, 4) for key, value in rounded.items()}, "broken": plant.broken}


if __name__ == "__main__":
    what = sys.argv[1] if len(sys.argv) > 1 else "cost"
    if what == "press":
        for each in press(float(sys.argv[2]) if len(sys.argv) > 2 else 2.0):
            print(json.dumps(each), flush=True)
    else:
        print(json.dumps(cost(int(sys.argv[2]) if len(sys.argv) > 2 else 1000), indent=1))
