"""HTIDKC: hierarchical-task inverse differential kinematic control, with which the paper compares HTMPC."""

from __future__ import annotations

from collections.abc import Mapping
from time import perf_counter_ns
from typing import final

import numpy as np

from himpc.htmpc.differential import Box, DifferentialController, Solved, wanted
from himpc.htmpc.kernel.kinds import VELOCITY
from himpc.htmpc.plan import ActiveMotionRows, LevelEvidence
from himpc.htmpc.settings import HTMPCSettings
from himpc.htmpc.tracking import check_dimensions
from himpc.kinematics.configuration import Configuration
from himpc.qp import QPSolution, solve_qp
from himpc.references import Preview
from himpc.stack import Level, Stack
from robots.arrays import Array


@final
class HTIDKC(DifferentialController):
    """A cascade of regularised QPs. It also uses the settings `rho` and `solver`. The authors use a rate of
    50 Hz.

    Level 0 minimises the violation of the bounds. The bounds form a box, one interval per joint, so its
    solution is the nearest point of the box that the accelerations allow. Level l then solves min ½‖J_l q̇ −
    ẋ_l‖² + ½ρ‖q̇‖² inside the intervals of level 0, with J_i q̇ = J_i q̇*_i for the levels i above.
    """

    def _fit(self, levels: Stack, settings: HTMPCSettings) -> None:
        check_dimensions(self.robot, levels)

    def _solve(self, here: Configuration, previews: Mapping[str, Preview], box: Box) -> Solved:
        command = box.rest
        above: list[tuple[Array, Array]] = []
        levels: list[LevelEvidence] = []
        for index, level in enumerate(self._levels):
            gain = self._gain(index)
            J = np.vstack([task.jacobian(here)[0] for task in level.tasks])
            goal = np.concatenate([wanted(task, here, previews, gain) for task in level.tasks])
            begun = perf_counter_ns()
            solution = self._optimum(J, goal, box, above)
            if solution.solved:
                command = np.clip(solution.x, box.lower, box.upper)
            above.append((J, J @ command))
            levels.append(self._evidence(level, J @ command - goal, solution, begun))
        return Solved(command, tuple(levels))

    def _optimum(self, J: Array, goal: Array, box: Box, above: list[tuple[Array, Array]]) -> QPSolution:
        n = self.robot.n
        A = np.vstack([np.eye(n), *(rows for rows, _ in above)])
        fixed = [value for _, value in above]
        return solve_qp(
            J.T @ J + self._settings.rho * np.eye(n),
            -J.T @ goal,
            A,
            np.concatenate([box.lower, *fixed]),
            np.concatenate([box.upper, *fixed]),
            self._settings.solver,
        )

    def _evidence(self, level: Level, gap: Array, solution: QPSolution, begun: int) -> LevelEvidence:
        multipliers = solution.multipliers[: self.robot.n]
        part = np.flatnonzero(np.abs(multipliers) > 1e-6)
        active = ActiveMotionRows(
            np.full(len(part), VELOCITY),
            np.ones(len(part), np.int64),
            part,
            multipliers[part],
            ("",) * len(part),
        )
        return LevelEvidence(
            name=level.name,
            status=solution.status,
            fallback="solve" if solution.solved else "keep",
            kkt_residual=solution.kkt_residual if solution.solved else 0.0,
            best=gap[None],
            final=gap[None],
            cost=0.5 * float(gap @ gap),
            steps=(1.0 if solution.solved else 0.0,),
            iterations=1,
            unsolved=int(not solution.solved),
            time_us=(perf_counter_ns() - begun) / 1e3,
            active=active,
        )
