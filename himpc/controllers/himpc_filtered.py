"""HIMPC followed by a safety filter, for comparison with distances inside the hierarchy."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from time import perf_counter_ns
from typing import final

import numpy as np
from numpy.typing import NDArray

from himpc.cascade.level import Fallback, LevelSolution
from himpc.controllers.distance_filter import DistanceFilter, Filtered
from himpc.controllers.himpc import HIMPC
from himpc.formulation.forms import usable
from himpc.formulation.settings import Settings
from himpc.plan import AtOnce, Behind, Plan
from himpc.references import Preview
from himpc.references.outlook import observed_by

Array = NDArray[np.float64]

FILTER = "filter"
"""The name of the filter in lists of levels."""


@final
class FilteredHIMPC(HIMPC):
    """HIMPC without rows of distances in its levels, and a `DistanceFilter` that changes its torque.
    Control-barrier filters work in the same way (for example OSCBF, arXiv 2503.06736). If `avoidance.on` is
    false, the controller is HIMPC. At the next tick, the levels use the torque that acted, which is the
    filtered torque.
    """

    def reset(self, tau_0: Array) -> None:
        super().reset(tau_0)
        if self._filter is not None:
            self._filter.forget()

    @property
    def settings(self) -> Settings:
        """The settings that were given. The levels have the same settings, but with `avoidance.on` false."""
        return self._original_settings

    def _apply(self, settings: Settings) -> None:
        limits = settings.limits
        distance_filter = DistanceFilter(self.robot, settings) if limits.avoidance.on else None
        avoidance = replace(limits.avoidance, on=False)
        guard = limits.stall_guard and not limits.avoidance.on
        super()._apply(replace(settings, limits=replace(limits, avoidance=avoidance, stall_guard=guard)))
        self._original_settings, self._filter = settings, distance_filter

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period, see `HIMPC.step`; `behind` of a plan is the result of the filter."""
        plan = super().step(q, v, previews, tau_applied)
        if self._filter is None:
            return plan
        if not usable(q) or not usable(v):
            self._filter.forget()
            return plan
        started = perf_counter_ns()
        filtered = self._filter(q, v, plan.tau_0, plan.tau, self._M_bar, plan.limits, observed_by(previews))
        self._tau_0 = filtered.tau
        done = None if plan.at_once is None else plan.at_once()
        time_us = (perf_counter_ns() - started) / 1e3
        return replace(
            plan,
            tau=filtered.tau,
            step_us=plan.step_us + time_us,
            unsolved=plan.unsolved + (not filtered.met),
            at_once=None if done is None else lambda: _with_filter(done, filtered.tau - plan.tau_0),
            behind=Behind(self._evidence(filtered, plan, done, time_us), filtered.rows),
        )

    def _evidence(self, filtered: Filtered, plan: Plan, done: AtOnce | None, time_us: float) -> LevelSolution:
        increment, leak = filtered.tau - plan.tau_0, 0.0
        if done is not None and len(done.increments):
            accelerations = (increment - done.increments) / self._M_bar
            pairs = zip(done.jacobians, accelerations, strict=False)
            leak = max((float(np.abs(J @ a).max()) for J, a in pairs if len(J)), default=0.0)
        change = (filtered.tau - plan.tau) / self._M_bar
        fallback: Fallback = "solve" if filtered.met else "soften"
        status = "optimal" if filtered.met else "rows give way"
        return LevelSolution(
            FILTER,
            increment[None],
            float(change @ change),
            filtered.active,
            0.0,
            status,
            fallback,
            time_us,
            time_us,
            leak,
        )


def _with_filter(done: AtOnce, increment: Array) -> AtOnce:
    """Returns the data of the levels, in which the applied increment replaces the last level's increment."""
    if not len(done.increments):
        return done
    return AtOnce(np.vstack([done.increments[:-1], increment]), done.jacobians)
