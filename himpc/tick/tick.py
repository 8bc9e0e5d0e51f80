"""One control period by the compiled kernel: its inputs from a controller, and the plan that it returns."""

from __future__ import annotations

import math
from collections.abc import Mapping
from time import perf_counter_ns

import numpy as np

from himpc.cascade.level import FALLBACKS, LevelProblem, LevelSolution
from himpc.formulation.forms import Prepared
from himpc.formulation.memory import Memory
from himpc.formulation.settings import Settings
from himpc.limits import LimitsInForce, Rows
from himpc.limits.constraints import imposed
from himpc.limits.distance import DISTANCE
from himpc.plan import AtOnce, Evidence, Plan
from himpc.printed import knots
from himpc.references import Preview
from himpc.references.outlook import observed_by
from himpc.telemetry import Layout
from himpc.tick.configure import arena_for, write_limits, write_velocity_limits
from himpc.tick.distances import Distances
from himpc.tick.fallbacks import perform
from himpc.tick.gather import gathered
from himpc.tick.kernel.arena import Snapshot
from himpc.tick.kernel.arrays import PERIOD, PULL, Array
from himpc.tick.kernel.control_period import (
    ALL_PARTS,
    FINISH,
    ITERATION,
    NOT_FINITE,
    REMEMBER,
    control_period,
)
from himpc.tick.kernel.progress import progress
from himpc.tick.preview_writer import PreviewWriter
from himpc.tick.problems import solutions, write_warm_start
from himpc.tick.python_bounds import PythonBounds
from himpc.tick.python_rows import PythonRows
from himpc.tick.tables import budget_of, write_effects, write_numbers
from robots import Robot


class CompiledTick:
    """The arena of one controller.

    Attributes:
        budget: the largest number of multiplications in a tick.
        distances: the pairs whose distances are kept; None if none are.

    Args:
        robot: gives the geometry.
        settings: as for the controller.
        prepared: the levels that are solved, and the tasks of which only the errors are computed.
        alone: whether the levels have no priorities, see `write_levels`. The solution of the last level is
            then applied, and the other levels are solved for the evidence only.
        tolerance: N·m; all levels are solved again, along their own prediction, until no increment changes by
            more than this, see `NHIMPC`.
        most: largest number of these iterations.
    """

    def __init__(
        self,
        robot: Robot,
        settings: Settings,
        prepared: Prepared,
        alone: bool = False,
        tolerance: float = math.inf,
        most: int = 1,
    ) -> None:
        form = prepared.form
        levels = 0 if prepared.idle else len(form.levels)
        self.arena, self._spans = arena_for(robot, settings, form, prepared.off, levels)
        self._python_rows = PythonRows(robot, self.arena, self._spans)
        self._ends = np.array([span.stop for _, _, span in self._spans[: len(form.tasks)]], np.intp)
        constraints, f = imposed(settings.limits), self.arena.f
        self._rows = Rows(f["L"], f["lower"], f["upper"], constraints)
        on = DISTANCE in constraints
        self.distances = Distances(robot, settings.limits.avoidance) if on else None
        self._python_bounds = PythonBounds(self.arena, constraints, self.distances)
        self._tolerance, self._most = tolerance, most
        self._limits: LimitsInForce | None = None
        self._started = False
        self._writer = PreviewWriter(self.arena, self._python_rows, settings)
        self._gathered: tuple[Layout, Array | None] | None = None
        self._ticks, self.budget = 0, budget_of(self.arena)
        self._alone = alone
        self.change(settings, prepared)

    def change(self, settings: Settings, prepared: Prepared) -> None:
        """Writes the numbers of settings of the same structure, see `same_structure`. The memory remains,
        except the previous velocities of tasks, which no longer belong to the levels."""
        self._settings, self._form = settings, prepared.form
        self._solved = () if prepared.idle else prepared.form.levels
        write_numbers(self.arena, settings, self._form, prepared.idle, self._alone)
        if self.distances is not None:
            self.distances.change(settings.limits.avoidance)
        self._shares: list[float | Array] = [1.0] * len(self._form.levels)
        self._looked = False
        self.arena.i["known"][0] = 0

    def recall(self, memory: Memory | None, q: Array, v: Array) -> None:
        """Copies a controller's memory into the arena. Without a memory, constant velocity is assumed for the
        past."""
        N, T_s = self._settings.horizon, self._settings.T_s
        memory = memory or Memory(q, v, T_s)
        f, i = self.arena.f, self.arena.i
        f["q_was"][:], f["v_was"][:], f["scalars"][0] = memory.q, memory.v, memory.period
        i["known"][:], i["warm_count"][:], f["U_was"][:] = 0, 0, 0.0
        if memory.predicted_q is not None and len(memory.predicted_q) == N + 1:
            f["path"][:] = memory.predicted_q  # unchanged numbers stay bitwise the same
        else:
            f["path"][1], f["path"][2 : N + 1] = q, knots(memory.predicted_q, q, v, N, T_s)[1:]
        for index, level in enumerate(self._solved):
            before = memory.solutions.get(level.name)
            if before is not None:
                f["fallback"][index] = FALLBACKS.index(before.fallback)
                write_warm_start(self.arena, index, before.active)
                if before.U.shape == f["U"][index].shape:
                    f["U_was"][index], i["known"][1] = before.U, 1
        self._started = True

    def forget(self) -> None:
        """Clears the memory."""
        self._started = self._looked = False

    @property
    def memory(self) -> Memory | None:
        """A copy of the memory, from which another controller can continue."""
        if not self._started:
            return None
        f, i = self.arena.f, self.arena.i
        levels = self._solutions(self.arena.snapshot()) if i["known"][1] else []
        return Memory(
            f["q_was"].copy(),
            f["v_was"].copy(),
            float(f["scalars"][PERIOD]),
            predicted_q=f["path"].copy(),
            solutions={level.name: level for level in levels},
        )

    def progress(self) -> tuple[Array, float]:
        """Returns the length of the last error of each solved task, m or rad, and the largest velocity of a
        row of a reference, m/s or rad/s."""
        lengths = np.empty(len(self._ends))
        return lengths, progress(*self.arena.arguments, self._ends, lengths)

    def pull(self, largest_error: float) -> None:
        """Sets the largest error on which tasks act, m or rad."""
        self.arena.f["scalars"][PULL] = largest_error

    def fade(self, index: int, share: float | Array) -> None:
        """Multiplies a level's √Q by `share`, one number or one per row."""
        if not np.array_equal(share, self._shares[index]):
            level, self._shares[index] = self._form.levels[index], share
            write_effects(self.arena, level.rows, level.root_Q, level.C, level.knots, share)

    def take_M_bar(self, M_bar: Array) -> None:
        """Sets the diagonal of M̄, (n,) kg·m²."""
        self.arena.f["M_bar"][:] = M_bar

    def problems(self) -> list[LevelProblem]:
        """Returns a copy of the data of every level at the last tick; none before the first one."""
        if not self._looked:
            return []
        f, form = self.arena.f, self._form
        rows = sum(form.sizes)
        B, free = f["B"][:, :rows].copy(), f["free"][:, :rows].copy()
        return [level.problem(B, free, share) for level, share in zip(form.levels, self._shares, strict=True)]

    def step(
        self,
        q: Array,
        v: Array,
        previews: Mapping[str, Preview],
        tau_0: Array,
        limits: LimitsInForce,
        started: int,
    ) -> Plan | None:
        """Computes one control period; returns None if the problems of this state are not finite.

        Args:
            q, v: measured state, (n,).
            previews: the previews of all tasks.
            tau_0: torque that acts now, (n,) N·m.
            limits: the limits in force.
            started: when the period began, ns.
        """
        self._take(q, v, previews, tau_0, limits)
        arena = self.arena
        change, iterations, unsolved = math.inf, 0, 0
        parts = ALL_PARTS if self._most == 1 else ITERATION
        arena.f["budget"][:] = self.budget
        while iterations == 0 or (change > self._tolerance and iterations < self._most):
            if iterations:
                # J_i(q_{k+j|k}): the knots of this tick's own prediction replace the knots of the last tick's
                # prediction.
                arena.f["path"][1:] = arena.f["predicted"][:-1]
                before = arena.f["U"].copy()
            else:
                before = None
            self._python_rows.write(previews)
            self._rows = self._python_bounds.write(self._rows, self._settings, limits, observed_by(previews))
            unsolved = perform(arena, parts, self._rows)
            if unsolved == NOT_FINITE:
                return None
            self._looked = True
            iterations += 1
            if before is not None:
                change = float(np.abs(arena.f["U"] - before).max())
            if unsolved:
                break  # another iteration needs optima at all levels
        if self._most > 1:
            control_period(*arena.arguments, FINISH + REMEMBER, 0, 0.0)
        return self._plan(unsolved, tau_0, limits, iterations, started)

    def _take(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_0: Array, limits: LimitsInForce
    ) -> None:
        if not self._started:
            self.recall(None, q, v)
        self._ticks += 1
        f = self.arena.f
        f["q"][:], f["v"][:], f["tau_0"][:] = q, v, tau_0
        if limits is not self._limits:
            if self._limits is None or not limits.differs_in_velocity_only(self._limits):
                write_limits(self.arena, limits, self._settings.limits.position == "paper")
            else:
                write_velocity_limits(self.arena, limits.v_limit)
            self._limits = limits
        self._writer.write(previews)

    def _solutions(self, snapshot: Snapshot) -> list[LevelSolution]:
        return solutions([level.name for level in self._solved], snapshot) if self._solved else []

    def _plan(
        self, unsolved: int, tau_0: Array, limits: LimitsInForce, iterations: int, started: int
    ) -> Plan:
        ticks = self._ticks
        idle_us = float(self.arena.f["time_us"][:-1].sum()) if self._alone else 0.0

        def evidence() -> Evidence:
            if self._ticks != ticks:
                raise RuntimeError("a later tick has replaced this plan's data: store plan.freeze() instead")
            return self._evidence()

        return Plan(
            tau=self.arena.f["tau"].copy(),
            tau_0=tau_0,
            limits=limits,
            step_us=(perf_counter_ns() - started) / 1e3 - idle_us,
            unsolved=unsolved,
            find_evidence=evidence,
            iterations=iterations,
            fill=self._fill,
            at_once=self._at_once,
            M_bar=self.arena.f["M_bar"].copy() if self._settings.M_bar_adapt else None,
        )

    def _evidence(self) -> Evidence:
        snapshot = self.arena.snapshot()
        R, value, error = snapshot("R_now"), snapshot("value"), snapshot("error")
        stopping = snapshot("stopping") > 0.0 if self._settings.limits.position == "viability" else None
        return Evidence(
            levels=tuple(self._solutions(snapshot)),
            q=snapshot("predicted"),
            errors={task.name: error[span] for _, task, span in self._spans},
            values={
                task.name: R[index] if task.name in self._python_rows.turning else value[span]
                for index, task, span in self._spans
            },
            rows=self._rows._replace(
                lower=snapshot("lower"),
                upper=snapshot("upper"),
                stopping=stopping,
                directions=tuple(
                    block and block._replace(D=block.D.copy()) for block in self._rows.directions
                ),
            ),
        )

    def _at_once(self) -> AtOnce:
        f, count = self.arena.f, len(self._solved)
        J = f["B"][0] * f["M_bar"]
        return AtOnce(f["U"][:count, 0].copy(), [J[level.rows] for level in self._solved[:-1]])

    def _fill(self, row: Array, layout: Layout) -> bool:
        """Writes a row of telemetry in one gather operation, see `Plan.fill`."""
        if self._gathered is None or self._gathered[0] is not layout:
            levels = [level.name for level in self._solved]
            self._gathered = layout, gathered(self.arena, layout, self._spans, levels)
        index = self._gathered[1]
        if index is None:
            return False
        self.arena.data.take(index, out=row, mode="clip")
        return True
