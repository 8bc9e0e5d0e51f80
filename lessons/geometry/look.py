"""The QPs of the last tick of a session, for drawing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from himpc.cascade.level import LevelProblem, LevelSolution
from himpc.controllers import HIMPC, OSF, Weighted
from himpc.controllers.weighted import compromise
from himpc.plan import Plan
from himpc.tick.problems import solve_problems
from lessons.geometry.matrix import Matrix, matrix
from lessons.geometry.plane import Plane, cut
from lessons.session.bumpless import Handover
from lessons.session.torque import TorqueSession
from robots import InputError
from robots.arrays import Array


@dataclass(frozen=True, eq=False)
class TickProblems:
    """The problems and solutions of the strict hierarchy at one tick, whichever controller ran.

    Attributes:
        plan: the plan that was applied.
        problems: the levels' QPs, highest priority first.
        strict: the solutions of `problems` in strict order of priority; those of the plan if the
            controller is strict.
    """

    plan: Plan
    problems: Sequence[LevelProblem]
    strict: Sequence[LevelSolution]


def tick_of(session: TorqueSession) -> TickProblems:
    """Returns the last tick.

    Raises:
        InputError: no tick has run yet, or the controller does not solve such QPs.
    """
    controller, plan = session.controller, session.plan
    if isinstance(controller, Handover):
        controller = controller.new
    if not isinstance(controller, HIMPC):
        raise InputError(
            f"{session.settings.controller} does not solve such QPs: choose himpc, hiqp, nhimpc or weighted"
        )
    if plan is None:
        raise InputError("No QP was solved yet: let the robot run, or take a single tick (key T)")
    problems = controller.problems
    if len(problems) != len(plan.levels):
        raise InputError("This tick held the torque and solved no QP: let the robot continue")
    strict: Sequence[LevelSolution] = plan.levels
    if isinstance(controller, Weighted):
        strict = solve_problems(problems, plan.rows, {})
    return TickProblems(plan, problems, strict)


def plane_of(session: TorqueSession, joints: tuple[int, int], through: str, shift: float = 0.0) -> Plane:
    """Returns the cut through the QPs of the last tick in the plane of the first increments of two joints.

    Args:
        session: the session.
        joints: the two joints, counted from 0.
        through: name of the level whose solution lies in the cut; any other word: the applied solution lies
            in the cut.
        shift: offset of the other joints' first increments from that solution, N·m.

    Raises:
        InputError: there is no such tick, see `tick_of`.
    """
    tick = tick_of(session)
    solved = {level.name: level.U for level in tick.strict}
    held = np.array(solved.get(through, tick.plan.levels[-1].U))
    others = [joint for joint in range(held.shape[1]) if joint not in joints]
    held[0, others] += shift
    plane = cut(tick.problems, tick.plan.rows, [level.U for level in tick.strict], joints, held)
    pair = list(joints)
    together = _weighted(session, tick)
    osf = _osf(session, tick.plan)
    return replace(
        plane,
        weighted=None if together is None else together[0, pair],
        osf=None if osf is None else osf[pair],
    )


def matrix_of(session: TorqueSession, level: str) -> Matrix:
    """Returns the QP of a level at the last tick; the QP of the first level if no level has this name.

    Raises:
        InputError: there is no such tick, see `tick_of`.
    """
    tick = tick_of(session)
    names = [problem.name for problem in tick.problems]
    index = names.index(level) if level in names else 0
    return matrix(tick.problems[index], tick.plan.rows, tick.strict[index])


def _weighted(session: TorqueSession, tick: TickProblems) -> Array | None:
    """Returns the optimum of one weighted cost of all tasks under the same bounds, (N, n) N·m."""
    if isinstance(session.controller, Weighted):
        return tick.plan.levels[-1].U
    return compromise(tick.problems, tick.plan.rows)


def _osf(session: TorqueSession, plan: Plan) -> Array | None:
    """Returns the change of torque that OSF would demand at the same state, (n,) N·m."""
    controller_input = session.controller_input
    if controller_input is None:
        return None
    osf = OSF(session.robot, session.settings.for_controller())
    osf.reset(plan.tau_0)
    demand = osf.step(controller_input.q, controller_input.v, controller_input.previews, plan.tau_0)
    return None if demand.unsolved else demand.tau - plan.tau_0
