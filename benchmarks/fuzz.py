"""Runs torque-level scenes with hostile states, settings and events, and counts exceptions, NaN and slow
ticks.

    python -m benchmarks.fuzz [--ticks 1000000] [--seed 0] [--minutes 60] [--episode SEED]

Every episode runs a random scene and controller for some hundred ticks. Between the ticks the robot is set to
impossible states, the torque sensor returns invalid values, and settings and targets change. The program
counts exceptions, numbers that are not finite, torques above the robot's own limit, and ticks that used more
than 20 ms of processor time. For each fault it prints a line with the seed of the episode; `--episode SEED`
repeats this episode. At the end or after an interruption it prints a summary in JSON. The exit code is 1 if
there was any fault.
"""

from __future__ import annotations

import argparse
import gc
import json
import sys
import traceback
from collections import Counter
from contextlib import suppress
from dataclasses import dataclass, field, replace
from time import monotonic, thread_time

import numpy as np
from numpy.typing import NDArray

from himpc.plan import Plan
from himpc.references import Outlook
from lessons.events import Event, MoveLevel, MoveTarget, Push, Reset, Set
from lessons.scenes.catalog import torque_scene
from lessons.session.torque import TorqueSession

Array = NDArray[np.float64]

SCENES = (
    "iiwa14-circle",
    "iiwa14-hold",
    "iiwa14-hold",
    "panda-hold",
    "planar3-circle",
    "planar3-conflict",
    "planar3-hold",
    "planar3-singular",
    "iiwa14-circle-paper",
    "ridgeback-ur10-hold",
)
CONTROLLERS = ("himpc",) * 6 + ("hiqp", "nhimpc", "weighted", "weighted", "hqp", "tdeosf")
BOUNDED = ("himpc", "hiqp", "nhimpc", "weighted", "hqp")
"""Controllers that impose the torque bounds."""
LONGEST_S = 0.020
_KNOTS = 150
"""Largest product of joints and knots. An undisturbed step of this size must take much less than
LONGEST_S."""


@dataclass
class Tally:
    """The counts, and the faults that were found."""

    ticks: int = 0
    episodes: int = 0
    faults: Counter[str] = field(default_factory=Counter)
    fallbacks: Counter[str] = field(default_factory=Counter)
    longest_ms: float = 0.0
    lines: list[str] = field(default_factory=list)

    def fault(self, kind: str, seed: int, tick: int, what: str) -> None:
        """Counts a fault, and prints the first of each kind in an episode."""
        self.faults[kind] += 1
        line = f"{kind}: --episode {seed}, tick {tick}: {what}"
        if not any(each.startswith(f"{kind}: --episode {seed},") for each in self.lines):
            self.lines.append(line)
            print(line, flush=True)


def state(rng: np.random.Generator, session: TorqueSession) -> tuple[Array, Array]:
    """Returns a measured state with an error of any size, or with invalid values."""
    q, v = session.plant.q, session.plant.v
    n, robot = q.size, session.robot
    match int(rng.integers(8)):
        case 0:
            return rng.uniform(-3, 3, n), rng.normal(0, 1, n)
        case 1:
            return q, v + robot.v_limit * rng.normal(0, 10.0 ** rng.uniform(-1, 3), n)
        case 2:
            return q + rng.normal(0, 10.0 ** rng.uniform(-6, 4), n), v
        case 3:
            return q * 10.0 ** rng.uniform(0, 12), v * 10.0 ** rng.uniform(0, 12)
        case 4:
            edge = np.where(rng.random(n) < 0.5, robot.q_lower, robot.q_upper)
            return np.where(np.isfinite(edge), edge + rng.normal(0, 0.05, n), q), 2 * robot.v_limit
        case 5:
            odd = rng.choice([np.nan, np.inf, -np.inf, 1e308, 1e-308, 0.0], n)
            return np.where(rng.random(n) < 0.3, odd, q), np.where(rng.random(n) < 0.2, odd, v)
        case 6:
            return np.zeros(n), np.zeros(n)
        case _:
            return q + 1e-7 * rng.normal(size=n), -v


def event(rng: np.random.Generator, session: TorqueSession) -> Event:
    """Returns an event that a learner may cause, with values of any size."""
    settings, robot = session.settings, session.robot
    level = settings.levels[int(rng.integers(len(settings.levels)))].name
    size = float(10.0 ** rng.uniform(-3, 3))
    chance = float(rng.random())
    numbers: list[Event] = [
        Set("horizon", int(rng.integers(1, max(2, min(30, _KNOTS // robot.n))))),
        Set("T_s", float(10.0 ** rng.uniform(-4, -1.7))),
        Set("M_bar_scale", size),
        Set("M_bar_adapt", chance < 0.7),
        Set("Q", 200.0 * size),
        Set("R", 10.0 * size),
        Set(f"levels.{level}.enabled", chance < 0.5),
        Set(f"levels.{level}.K_p", 100.0 * size),
        Set(f"levels.{level}.K_v", size),
        Set(f"levels.{level}.horizon", int(rng.integers(1, 10))),
        Set("limits.position", str(rng.choice(["paper", "viability", "off"]))),
        Set("limits.velocity_scale", size),
        Set("limits.torque_scale", min(size, 1.0)),
        Set("limits.velocity_approach", float(rng.choice([0.0, 1.0, 15.0, 1e4]))),
        Set("limits.velocity", chance < 0.7),
        Set("R_on", str(rng.choice(["torque", "acceleration"]))),
        Set("damping", chance < 0.5),
        Set("plant.payload_kg", 10.0 * chance),
        Set("plant.encoder_resolution_deg", 0.1 * chance),
        Set("plant.delay_ms", 10.0 * chance),
        Set("plant.saturate", chance < 0.8),
        MoveLevel(level, int(rng.integers(len(settings.levels)))),
        Reset(),
        Push(robot.joint_names[-1], tuple(rng.normal(0, 100 * size, 3)), seconds=0.1 * chance + 1e-3),
    ]
    targets = [name for name in session.references if session.target(name) is not None]
    if targets and chance < 0.5:
        name = targets[int(rng.integers(len(targets)))]
        target = session.target(name)
        assert target is not None
        width = 4 if target.raw.ndim == 2 else target.raw.size
        return MoveTarget(name, tuple((size * rng.normal(size=width)).tolist()))
    return numbers[int(rng.integers(len(numbers)))]


def check(tally: Tally, seed: int, tick: int, session: TorqueSession, plan: Plan, spent: float) -> None:
    """Checks the conditions that every plan must satisfy."""
    tally.ticks += 1
    tally.fallbacks.update(level.fallback for level in plan.levels)
    tally.longest_ms = max(tally.longest_ms, 1e3 * spent)
    if spent > LONGEST_S:
        shape = f"{session.settings.controller}, N = {session.settings.horizon}, {session.scene.name}"
        tally.fault("slow", seed, tick, f"{1e3 * spent:.1f} ms ({shape})")
    if not np.isfinite(plan.tau).all():
        tally.fault("not finite", seed, tick, str(plan.tau))
    # Without torque bounds any demand is allowed; the limit of the motors is a part of the plant.
    imposed = session.settings.limits.torque and session.settings.controller in BOUNDED
    excess = np.abs(plan.tau) - session.robot.tau_limit
    if imposed and (excess > 1e-9).any():
        tally.fault("torque", seed, tick, f"{plan.tau} above {session.robot.tau_limit}")


def episode(seed: int, ticks: int, tally: Tally) -> None:
    """Runs one episode."""
    rng = np.random.default_rng(seed)
    scene = torque_scene(str(rng.choice(SCENES)))
    most = max(2, min(30, _KNOTS // scene.robot.n))
    settings = replace(
        scene.settings,
        controller=str(rng.choice(CONTROLLERS)),
        horizon=int(rng.choice([1, 2, 3, 5, 5, 5, 10, most])),
    )
    session = TorqueSession(replace(scene, settings=settings))
    tally.episodes += 1
    gc.collect()
    gc.freeze()  # garbage collection is not part of a step
    wild, eventful = rng.choice([0.0, 0.02, 0.3]), rng.choice([0.0, 0.01, 0.1])
    for tick in range(ticks):
        try:
            if rng.random() < eventful:
                session.post(event(rng, session))
            session.drain()
            started = thread_time()
            if rng.random() < wild:
                q, v = state(rng, session)
                reading = session.plant.tau * 10.0 ** rng.uniform(-1, 4)
                if rng.random() < 0.1:
                    reading = np.full(q.size, rng.choice([np.nan, np.inf, 1e300]))
                outlook = Outlook(
                    session.references, session.t, session.settings.T_s, session.settings.horizon
                )
                started = thread_time()
                plan = session.controller.step(q, v, outlook, reading)
            else:
                session.tick()
                plan = session.plan
                assert plan is not None
            spent = thread_time() - started
            check(tally, seed, tick, session, plan, spent)
        except Exception as error:
            tally.ticks += 1
            place = traceback.extract_tb(error.__traceback__)[-1]
            tally.fault("exception", seed, tick, f"{error!r} at {place.filename}:{place.lineno}")
            return


def main() -> int:
    """Prints the faults and a summary."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--ticks", type=int, default=1_000_000)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--minutes", type=float, default=1e9)
    parser.add_argument("--length", type=int, default=400, help="ticks of an episode")
    parser.add_argument("--episode", type=int, help="the seed of the only episode to run")
    given = parser.parse_args()
    tally, began = Tally(), monotonic()
    seeds = np.random.SeedSequence(given.seed)
    with np.errstate(all="ignore"), suppress(KeyboardInterrupt):
        if given.episode is not None:
            episode(given.episode, given.length, tally)
        while given.episode is None and tally.ticks < given.ticks:
            if monotonic() - began > 60 * given.minutes:
                break
            episode(int(seeds.spawn(1)[0].generate_state(1)[0]), given.length, tally)
    print(
        json.dumps(
            {
                "ticks": tally.ticks,
                "episodes": tally.episodes,
                "faults": dict(tally.faults),
                "fallbacks": dict(tally.fallbacks),
                "longest_ms": round(tally.longest_ms, 2),
            }
        )
    )
    return 1 if tally.faults else 0


if __name__ == "__main__":
    sys.exit(main())
