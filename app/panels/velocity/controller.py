"""The settings of the velocity-level controller: its kind, horizon, strictness, weights, limits and delay."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from app.html.text import block, formula
from app.panels.widgets.controls import ControllerChoice, Controls
from app.tab.context import PageContext, SessionSnapshot
from himpc.htmpc import base_joints
from himpc.htmpc.settings import efforts
from lessons.settings.velocity import VelocitySettings

_COST = r"J_l = \tfrac12 \sum_{k<N} \lVert e_k \rVert_Q^2 + \tfrac12 \lVert e_N \rVert_P^2"


class HtmpcPanel:
    """All settings of the controller that can be changed while it runs."""

    def __init__(self, page: PageContext) -> None:
        gui, settings = page.gui, page.settings
        self._page, self._robot = page, page.robot
        self._controls = controls = Controls(gui, page.bindings, settings)
        self._choice = ControllerChoice(gui, controls, settings)
        with gui.add_folder("Horizon"):
            self._ahead = gui.add_html("")
            controls.add_group("Horizon")
        with gui.add_folder("How strict"):
            controls.add_group("How strict")
            with gui.add_folder("What a level minimises", expand_by_default=False):
                gui.add_html(formula(_COST))
                gui.add_html(
                    formula(r"|e_p| \le |e_p^*| + \delta \quad \text{for every level } p \text{ above}")
                )
                gui.add_html(
                    block("The errors that a level above can reach become a bound for the levels below it.")
                )
        self._weights()
        with gui.add_folder("Limits"):
            controls.add_group("Limits")
        with gui.add_folder("Delay"):
            self._lag = gui.add_html(block("", lines=3))
            controls.add_group("Delay")

    def _weights(self) -> None:
        gui = self._page.gui
        with gui.add_folder("Weights"):
            self._controls.add("terminal")
            self._effort("velocity_effort", "S", "all")
            for part in ("base", "arm") if base_joints(self._robot) else ("arm",):
                self._effort("input_effort", "R", part)
                self._effort("change_effort", "W", part)
            with gui.add_folder("HTIDKC and placo", expand_by_default=False):
                self._controls.add("gains.1", "gains.2", "first_level")

    def _effort(self, path: str, symbol: str, part: str) -> None:
        """Adds one slider for the weights of a group of joints."""
        robot = self._robot
        base = list(base_joints(robot))
        arm = [joint for joint in range(robot.n) if joint not in base]
        joints = {"base": base, "arm": arm, "all": [*base, *arm]}[part]

        def now(settings: VelocitySettings) -> np.ndarray:
            return np.array(getattr(efforts(robot, settings.htmpc), symbol), float)

        def made(value: float) -> list[float]:
            weights = now(self._page.settings)
            weights[joints] = value
            return weights.tolist()

        setting = self._page.settings.setting(path)
        if part != "all":
            setting = replace(setting, shown=replace(setting.shown, label=f"{setting.shown.label}, {part}"))
        self._controls.add_as(setting, lambda settings: now(settings)[joints].tolist(), made)

    def update(self, now: SessionSnapshot[VelocitySettings]) -> None:
        settings = now.settings
        self._choice.update(settings)
        htmpc = settings.htmpc
        self._ahead.content = block(
            f"Predicts the next <b>{htmpc.horizon * htmpc.dt:.2g} s</b>, every {1e3 * htmpc.period:.3g} ms."
        )
        step_ms, lag = 1e-3 * now.number("step_us"), settings.plant.latency_ms
        self._lag.content = block(
            f"Lag of the plant: <b>{lag:g} ms</b>{_compensated(settings)}. The last control step took "
            f"{step_ms:.1f} ms of {1e3 * htmpc.period:.3g} ms; "
            + ("this time delays the robot." if settings.delay_measured else "simulated time waits."),
            lines=3,
        )


def add_servo_plant(page: PageContext) -> None:
    """Adds the controls of the true plant's settings. The controller knows at most its lag."""
    page.gui.add_html(
        block("These are the true values of the simulated robot. The controller knows at most the lag.")
    )
    Controls(page.gui, page.bindings, page.settings).add_group("Plant")


def _compensated(settings: VelocitySettings) -> str:
    if settings.plant.latency_ms == 0.0 and not settings.delay_measured:
        return ""
    return ", compensated by prediction" if settings.compensate_delay else ", not compensated"
