"""Switches the controller while the robot moves: for a short time both controllers act."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np

from himpc.controllers import HIMPC, Controller, Settings
from himpc.controllers.distance_filter import DistanceFilter
from himpc.formulation.forms import usable
from himpc.plan import Plan
from himpc.references import Preview
from himpc.references.outlook import observed_by
from robots import InputError
from robots.arrays import Array

HANDOVER_SECONDS = 0.3


class Handover:
    """Runs two controllers and changes the torque from one to the other: τ = (1 − s) τ_old + s τ_new.

    s = 3x² − 2x³ rises from 0 to 1 in HANDOVER_SECONDS. The torques of two controllers differ, for example by
    the error of a model; the blend spreads this step over time. Both controllers get the measured state and
    the torque that acted. Therefore the blend lies within the torque bounds if both torques do. If the new
    controller keeps distances, a `DistanceFilter` changes the blend: no distance bounds the old torque.
    Evidence and prediction are those of the new controller.
    """

    def __init__(self, old: Controller, new: Controller) -> None:
        """`new` must have been reset to the torque that acts now."""
        self._old: Controller | None = old
        self.new = new
        self._elapsed = 0.0
        self._filter = _filter_of(new)

    @property
    def settings(self) -> Settings:
        """The new controller's settings."""
        return self.new.settings

    @property
    def done(self) -> bool:
        """Whether only the new controller still acts."""
        return self._old is None

    def reset(self, tau_0: Array) -> None:
        """Ends the hand-over: the new controller starts afresh from τ₀."""
        self._old = None
        self.new.reset(tau_0)

    def configure(self, settings: Settings) -> None:
        """Gives the settings to both controllers. Raises InputError, without any change, if they do not fit
        the new controller."""
        self.new.configure(settings)
        self._filter = _filter_of(self.new)
        if self._old is not None:
            try:
                self._old.configure(settings)
            except InputError:
                self._old = None

    def step(
        self, q: Array, v: Array, previews: Mapping[str, Preview], tau_applied: Array | None = None
    ) -> Plan:
        """Computes one control period of both controllers; `step_us` counts the new controller only."""
        plan = self.new.step(q, v, previews, tau_applied)
        if self._old is None:
            return plan
        leaving = self._old.step(q, v, previews, tau_applied).tau
        self._elapsed += self.new.settings.T_s
        x = min(1.0, self._elapsed / HANDOVER_SECONDS)
        if x >= 1.0 or not np.isfinite(leaving).all():
            self._old = None
            return plan
        share = x * x * (3.0 - 2.0 * x)
        tau = (1.0 - share) * leaving + share * plan.tau
        if self._filter is None or not (usable(q) and usable(v) and usable(tau)):
            return replace(plan, tau=tau, fill=None)
        M_bar = np.array(self.settings.M_bar) if plan.M_bar is None else plan.M_bar
        filtered = self._filter(q, v, plan.tau_0, tau, M_bar, plan.limits, observed_by(previews))
        return replace(plan, tau=filtered.tau, unsolved=plan.unsolved + (not filtered.met), fill=None)


def _filter_of(controller: Controller) -> DistanceFilter | None:
    """Returns a filter for the settings of a controller that keeps distances, otherwise None."""
    if isinstance(controller, HIMPC) and controller.settings.limits.avoidance.on:
        return DistanceFilter(controller.robot, controller.settings)
    return None


def settled(controller: Controller) -> Controller:
    """Returns the controller itself or, for a finished hand-over, its new controller."""
    return controller.new if isinstance(controller, Handover) and controller.done else controller
