"""Whether a robot moves well: its target is dragged away and back under HIMPC, without a page."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from itertools import compress, product
from time import process_time

import numpy as np
import pinocchio as pin

from himpc.references.target import POSITION_CAPS
from lessons.events import MoveTarget
from lessons.scenes.hold import hold_robot
from lessons.session.start import begin
from robots import Robot
from robots.arrays import Array
from robots.covering.covers import near
from robots.errors import listed, shortened
from robots.joints import chain_length
from robots.plant import Plant
from robots.reach import ReachJudge

SHARE = 0.15
"""Length of the drag as a share of the arm's length."""
START, HOLD = 0.1, 2.0  # s: when the target moves first, and how long it is at least at each place
_REST = 1.0  # s: least part of this time after the target, which moves with a limited speed, is there
FOLLOWS = 0.01  # largest error, as a share of the drag, of a robot that follows
_MARGIN = 0.02  # rad or m: nearest that a joint comes to its limit at a target
_NEAR = 2e-3  # m: difference from the distance to keep at which it holds a robot back
_FAST = 0.8  # share of a speed limit at which a joint counts as held back by it
_STILL = 0.01  # largest speed, as a share of its limit, of a joint at rest
_SECONDS = 120.0  # s of processor time for a drag


@dataclass(frozen=True)
class Motion:
    """What was measured while the target was dragged.

    Attributes:
        drag: length of the drag, m; 0 if no target was found that the tip can reach.
        error: distance of the tip from the target `seconds` after the drag, m.
        back: the same after the way back.
        torque, speed: largest share of a joint's limit.
        rest: whether all joints are at rest at the end.
        lost: simulated time at which control was lost, s; None if it was not.
        over: whether the time of the computation ended before the drag.
        why: the limits and contacts at the first target that the tip did not reach; "" if there are none.
    """

    drag: float
    error: float = math.nan
    back: float = math.nan
    torque: float = math.nan
    speed: float = math.nan
    rest: bool = False
    lost: float | None = None
    over: bool = False
    why: str = ""

    @property
    def seconds(self) -> float:
        """How long the target was held, s: 2 s, and longer if it needs more than 1 s for the drag."""
        return max(HOLD, self.drag / POSITION_CAPS.speed + _REST)

    @property
    def follows(self) -> bool:
        """Whether the tip was within 1 % of the drag both times, and control was not lost."""
        return self.lost is None and max(self.error, self.back) <= FOLLOWS * self.drag

    def __str__(self) -> str:
        if self.drag == 0.0:
            return "not dragged: no target at 15 % of the arm's length was found that it can reach"
        if self.over:
            return f"not known: a drag of {1e3 * self.drag:.0f} mm takes over {_SECONDS:.0f} s to compute"
        if self.lost is not None:
            return f"loses control {self.lost:.1f} s after the start of a drag of {1e3 * self.drag:.0f} mm"
        worst, drag = 1e3 * max(self.error, self.back), 1e3 * self.drag
        after = f"{self.seconds:.2g} s"
        end = "at rest" if self.rest else f"still moving {after} after the way back"
        how = f"follows within {worst:.2g} mm" if self.follows else f"stays {worst:.2g} mm away"
        return (
            f"{how} after {after} (drag of {drag:.0f} mm); uses {100 * self.torque:.0f} % of a torque limit "
            f"and {100 * self.speed:.0f} % of a speed limit; {end}{f' ({self.why})' if self.why else ''}"
        )


def dragged(robot: Robot) -> Motion:
    """Drags the target of a robot's hold scene by 15 % of the arm's length (see `target`), holds it there for
    2 s, and drags it back for 2 s, with HIMPC and the scene's own settings. A drag of more than 0.5 m takes
    longer, see `Motion.seconds`."""
    scene = hold_robot(robot)
    length = SHARE * chain_length(robot.model, robot.frame_id(robot.tip))
    avoidance = scene.settings.limits.avoidance
    kept = avoidance.d_safe + avoidance.margin if avoidance.on else 0.0
    there, home = target(robot, length, bool(scene.world), kept), skeleton(robot, robot.home)[-1]
    if there is None:
        return Motion(0.0)
    points, drag = (there, home), float(np.linalg.norm(there - home))
    hold = Motion(drag).seconds
    events = tuple(
        (START + k * hold, MoveTarget("position", tuple(map(float, point)))) for k, point in enumerate(points)
    )
    session = begin(replace(scene, events=events), 0)
    errors, torque, speed, why, began = [], 0.0, 0.0, "", process_time()
    at, row = session.layout.fields, np.empty(0)
    for point in points:
        while session.t < START + (len(errors) + 1) * hold - 0.5 * session.settings.T_s:
            row = session.tick()
            torque = max(torque, float(np.abs(row[at["tau"]] / robot.tau_limit).max()))
            speed = max(speed, float(np.abs(row[at["v"]] / robot.v_limit).max()))
            if session.diverged_at is not None:
                return Motion(drag, lost=max(session.diverged_at - START, 0.0))
            if process_time() - began > _SECONDS:
                return Motion(drag, over=True)
        errors.append(float(np.linalg.norm(session.plant.frame_pose(robot.tip)[1] - point)))
        why = why or ("" if errors[-1] <= FOLLOWS * drag else _at_limits(session.plant, *_distance(row, at)))
    still = float(np.abs(session.plant.v / robot.v_limit).max()) < _STILL
    return Motion(drag, *errors, torque=torque, speed=speed, rest=still, why=why)


def _distance(row: Array, at: Mapping[str, slice]) -> tuple[float, float]:
    """Returns the least distance of two links, or of a link and an object, and the distance to keep, m."""
    return float(row[at["distance"]][0]), float(row[at["distance_kept"]][0])


def _at_limits(plant: Plant, distance: float, kept: float) -> str:
    """Returns what a plant touches, the joints that are at a limit, and the least distance, m, if it is the
    one to keep."""
    robot = plant.robot
    at_torque = np.abs(plant.tau) > 0.99 * robot.tau_limit
    near = np.minimum(plant.q - robot.q_lower, robot.q_upper - plant.q) < _MARGIN
    fast = np.abs(plant.v) > _FAST * robot.v_limit
    touching = dict.fromkeys(" touches ".join(map(shortened, contact.between)) for contact in plant.contacts)
    limits = (("torque", at_torque), ("position", near), ("speed", fast))
    notes = [
        f"{listed(list(compress(robot.joint_names, reached)))} at the {what} limit"
        for what, reached in limits
        if reached.any()
    ]
    if distance < kept + _NEAR:
        notes.append(
            f"{1e3 * distance:.0f} mm to another link or an object, and {1e3 * kept:.0f} mm are kept"
        )
    return "; ".join([*list(touching)[:2], *notes])


def target(robot: Robot, drag: float, floor: bool, kept: float = 0.0) -> Array | None:
    """Returns the place (3,), m, to which the tip is dragged.

    Inverse kinematics from home tries 26 places, at the distance `drag`, m, along the axes and their
    diagonals. Of those that the tip can reach with all joints 20 mrad or mm away from their limits, the one
    is taken for which the joints turn by the least share of their range. If it can reach none of them, as
    with two joints, a place counts that is nearest to one of them and at least half as far. Above a floor,
    joints and tip stay half the drag above it, or as far as at home if that is less. A place at which links
    are nearer to one another than the distance `kept`, m, and are not so at home, as in the robot's own
    base, is only taken if there is no other. None: there is no place.
    """
    judge, span = ReachJudge(robot), np.clip(robot.q_upper - robot.q_lower, 0.0, 2.0 * np.pi)
    low, high = robot.q_lower + _MARGIN, robot.q_upper - _MARGIN
    home = skeleton(robot, robot.home)
    least = min(0.5 * drag, float(home[:, 2].min())) - 1e-3 if floor else -math.inf
    candidates: list[tuple[bool, float, int, Array, Array]] = []
    for index, signs in enumerate(corner for corner in product((0.0, 1.0, -1.0), repeat=3) if any(corner)):
        way = np.array(signs) / np.linalg.norm(signs)
        result = judge.solve(home[-1] + drag * way)
        q = np.clip(result.q, np.minimum(low, robot.home), np.maximum(high, robot.home))
        points = skeleton(robot, q)
        far = float(np.linalg.norm(points[-1] - home[-1])) >= 0.5 * drag
        if far and float(points[:, 2].min()) >= least:
            turn = float((np.abs(q - robot.home) / span).max())
            far_off = float(np.linalg.norm(points[-1] - home[-1] - drag * way)) > 0.1 * drag
            candidates.append((far_off, turn, index, q, points[-1]))
    places = sorted(candidates)
    at_home = near(robot, robot.home, kept)
    apart = (each for each in places if not near(robot, each[3], kept) - at_home)
    best = next(apart, places[0] if places else None)
    return None if best is None else best[-1]


def skeleton(robot: Robot, q: Array) -> Array:
    """Returns the origins of all joints and the tip in the world, (n + 1, 3) m."""
    data = robot.model.createData()
    pin.framesForwardKinematics(robot.model, data, q)
    joints = [placed.translation for placed in list(data.oMi)[1:]]
    return np.array([*joints, data.oMf[robot.frame_id(robot.tip)].translation])
