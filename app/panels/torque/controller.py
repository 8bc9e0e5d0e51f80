"""The settings of the controller: its kind, deadline, limits and solver; its horizon and M̄ with a gauge."""

from __future__ import annotations

import math
from collections import deque
from functools import partial

import viser

from app.html.palette import BAD, GOOD
from app.html.text import bar, block, formula, joint_labels
from app.panels.inside.matrix import SpectrumPicture
from app.panels.widgets.controls import ControllerChoice, Controls
from app.tab.context import PageContext, SessionSnapshot
from lessons.settings.period import USUAL, longest_period
from lessons.settings.torque import TorqueSettings
from robots import Robot

_LOOKS = 9
"""Number of updates over which the share of late ticks is computed: about two seconds."""


class ControllerPanel:
    """The settings of the controller that can be changed while it runs, except the horizon and M̄."""

    def __init__(self, page: PageContext) -> None:
        gui, settings = page.gui, page.settings
        controls = Controls(gui, page.bindings, settings)
        self._choice = ControllerChoice(gui, controls, settings)
        self._deadline = DeadlineFolder(gui, controls)
        with gui.add_folder("Limits"):
            controls.add("limits.torque", "limits.velocity")
            controls.add_group("Limits")
        with gui.add_folder("Distances", expand_by_default=False):
            controls.add_group("Distances")
        with gui.add_folder("Solver", expand_by_default=False):
            controls.add_group("Solver")

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        self._deadline.update(now)
        self._choice.update(now.settings)


class HorizonPanel:
    """The horizon and M̄, which stand below the rows of the levels.

    spectrum: the picture of the eigenvalues, beside the controls of M̄.
    """

    def __init__(self, page: PageContext) -> None:
        gui = page.gui
        controls = Controls(gui, page.bindings, page.settings)
        with gui.add_folder("Horizon and inertia estimate M̄", order=1.0):
            controls.add_group("Horizon", ends={"T_s": partial(_longest, page.robot)})
            controls.add_group("Inertia estimate M̄")
            self._gauge = gui.add_html("")
            controls.add_elements("M_bar", joint_labels(page.robot.joint_names), "Per joint, kg·m²")
            with gui.add_folder("Why M̄ matters", expand_by_default=False):
                self._norm = gui.add_html("")
                self.spectrum = SpectrumPicture(page.client, page.in_view)
                gui.add_html(
                    formula(r"\tau = \tau_0 + \bar M (\ddot q - \ddot q_0)")
                    + block("Time-delay estimation: torque and acceleration of the previous tick replace a "
                            "model of the whole dynamics, and M̄ replaces the inertia. The estimation error "
                            "decays to zero if the radius is below 1, as it is if the norm is.")
                    + formula(r"\rho(I - M^{-1} \bar M) < 1")
                )  # fmt: skip

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        self._gauge.content = _measured("spectral radius of I − M⁻¹M̄", now.number("gauge_radius"))
        self._norm.content = _measured("norm ‖I − M⁻¹M̄‖₂", now.number("gauge_norm"))


def _longest(robot: Robot, settings: TorqueSettings) -> float:
    """Returns the longest control period that is accepted, ms, in steps of the slider."""
    return max(1e3 * USUAL, 0.5 * math.floor(2e3 * min(longest_period(robot, settings), 1.0)))


def _measured(name: str, value: float) -> str:
    """Returns a number that should be below 1, with a gauge whose line marks 1."""
    return block(
        f"{name}: <b>{value:.3f}</b>{_verdict(value)}{bar(value / 2, GOOD if value < 1 else BAD, 0.5)}"
    )


def _verdict(value: float) -> str:
    return "" if value != value else " &lt; 1 ✓" if value < 1 else " ≥ 1"


def add_plant(page: PageContext) -> None:
    """Adds the controls of the true plant's settings. The controller does not know them."""
    page.gui.add_html(
        block("These are the true values of the simulated robot. The controller does not know them.")
    )
    # One factor per link, named by the joint that moves the link.
    links = {"plant.mass_scale": "Mass of each link", "plant.inertia_scale": "Inertia of each link"}
    controls = Controls(page.gui, page.bindings, page.settings)
    controls.add_group("Plant", links, joint_labels(page.robot.joint_names))


class DeadlineFolder:
    """Two sliders, and a line with the share of late ticks."""

    def __init__(self, gui: viser.GuiApi, controls: Controls[TorqueSettings]) -> None:
        with gui.add_folder("Deadline"):
            controls.add_group("Deadline")
            self._line = gui.add_html("")
        self._counts: deque[tuple[int, int]] = deque(maxlen=_LOOKS)

    def update(self, now: SessionSnapshot[TorqueSettings]) -> None:
        ticks, late = now.status.ticks, now.status.late
        if self._counts and ticks < self._counts[-1][0]:
            self._counts.clear()
        if not self._counts or ticks > self._counts[-1][0]:
            self._counts.append((ticks, late))
        first_ticks, first_late = self._counts[0]
        ran = ticks - first_ticks
        if now.settings.deadline_ms == 0:
            text = "Lockstep: no torque is ever late."
        elif ran == 0:
            text = "Late torques: no tick counted yet."
        else:
            text = f"Late torques: <b>{(late - first_late) / ran:.0%}</b> of the last {ran} ticks."
        self._line.content = block(text)
