"""The velocity-level controller: which one, how far ahead, how strict, weights, limits, delay."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import viser

from app.html.text import block, esc, formula
from app.panels.widgets.mirror import Bindings, scalar
from app.panels.widgets.sliders import add_box, add_menu, add_slider, add_whole
from app.panels.widgets.snapshot import Snapshot
from himpc.catalog import VELOCITY_CONTROLLERS
from himpc.htmpc import FORMULATIONS, LEXICOGRAPHIC, base_joints
from himpc.htmpc.settings import MAX_HORIZON, efforts
from lessons.settings.velocity import VelocitySettings
from robots import Robot

_GAINS = ("Gain of level 1 [1/s]", "Gain of level 2 [1/s]")


class HtmpcPanel:
    """Everything about the controller that can be changed while it runs."""

    def __init__(
        self,
        gui: viser.GuiApi,
        bindings: Bindings[VelocitySettings],
        settings: VelocitySettings,
        robot: Robot,
        current: Callable[[], VelocitySettings],
    ) -> None:
        self._gui, self._bindings, self._settings = gui, bindings, settings
        self._robot, self._current = robot, current
        with gui.add_folder("Which controller"):
            self._menu("Controller", "controller", tuple(VELOCITY_CONTROLLERS), "Switch while it moves")
            self._what = gui.add_html(block(esc(VELOCITY_CONTROLLERS[settings.controller])))
        self._shown = settings.controller
        with gui.add_folder("Horizon"):
            self._ahead = gui.add_html("")
            add_whole(
                gui,
                bindings,
                settings,
                "N",
                "horizon",
                (1, MAX_HORIZON),
                lambda s: s.htmpc.horizon,
                "Knots the controller looks ahead",
            )
            self._slider("Δt [ms]", "dt", (20, 300, 10), "Between two knots", 1e3)
            self._slider("Rate [Hz]", "rate_hz", (2, 50, 1), "Control steps per second; 10 in the paper")
        self._strictness()
        self._weights()
        self._limits()
        with gui.add_folder("Delay"):
            self._lag = gui.add_html("")
            add_box(
                gui,
                bindings,
                settings,
                "Compensate delay",
                "compensate_delay",
                lambda s: s.compensate_delay,
                "Predict the measured state forward by the plant's lag before planning",
            )
            add_box(
                gui,
                bindings,
                settings,
                "Delay as measured",
                "delay_measured",
                lambda s: s.delay_measured,
                "Commands arrive later by the time that planning took, as on a robot that does not wait",
            )

    def _menu(self, label: str, path: str, choices: tuple[str, ...], hint: str) -> None:
        read = (lambda s: s.controller) if path == "controller" else _of_htmpc(path)
        add_menu(self._gui, self._bindings, self._settings, label, path, choices, read, hint)

    def _slider(
        self, label: str, path: str, span: tuple[float, float, float], hint: str, unit: float = 1.0
    ) -> None:
        add_slider(
            self._gui, self._bindings, self._settings, label, path, span, _of_htmpc(path), hint, unit=unit
        )

    def _strictness(self) -> None:
        gui = self._gui
        with gui.add_folder("How strict"):
            self._slider(
                "δ [mm]",
                "delta_m",
                (0, 100, 1),
                "By how much a lower level may enlarge the error of a higher one at a knot, (13)",
                1e3,
            )
            self._menu("Formulation", "formulation", FORMULATIONS, "paper: every level pays the absolute "
                       "effort (10). proximal: upper levels pay for leaving the previous plan")  # fmt: skip
            self._menu("Lexicographic", "lexicographic", LEXICOGRAPHIC, "per_coordinate: (12), a bound on "
                       "every error. cost: (11), a bound on the level's cost")  # fmt: skip
            add_whole(
                gui,
                self._bindings,
                self._settings,
                "MAX_ITER",
                "max_iter",
                (1, 10),
                lambda s: s.htmpc.max_iter,
                "QPs per level and control step",
            )
            with gui.add_folder("What a level minimises", expand_by_default=False):
                gui.add_html(
                    formula(
                        r"J_l = \tfrac12 \sum_{k<N} \lVert e_k \rVert_Q^2 + \tfrac12 \lVert e_N \rVert_P^2"
                    )
                )
                gui.add_html(
                    formula(r"|e_p| \le |e_p^*| + \delta \quad \text{for every level } p \text{ above}")
                )
                gui.add_html(
                    block("The errors a level above could reach are a bound for the levels below it.")
                )

    def _weights(self) -> None:
        gui = self._gui
        with gui.add_folder("Weights"):
            self._slider("P / Q", "terminal", (0, 100, 1), "Weight of the last knot against the others, (8)")
            self._effort("S velocities", "velocity_effort", "S", "all", 2.0)
            for part in ("base", "arm") if base_joints(self._robot) else ("arm",):
                self._effort(f"R inputs, {part}", "input_effort", "R", part, 1.0)
                self._effort(f"W changes, {part}", "change_effort", "W", part, 1.0)
            with gui.add_folder("HTIDKC", expand_by_default=False):
                for place, label in enumerate(_GAINS):
                    add_slider(
                        gui,
                        self._bindings,
                        self._settings,
                        label,
                        "gains",
                        (0.0, 3.0, 0.05),
                        lambda s, place=place: _at(s.htmpc.gains, place),
                        "ẋ = ṙ + gain · (r − x)",
                        make=lambda s, value, place=place: _with(s.htmpc.gains, place, value),
                        current=self._current,
                    )

    def _effort(self, label: str, path: str, symbol: str, part: str, greatest: float) -> None:
        robot = self._robot
        base = list(base_joints(robot))
        arm = [joint for joint in range(robot.n) if joint not in base]
        joints = {"base": base, "arm": arm, "all": [*base, *arm]}[part]

        def now(settings: VelocitySettings) -> np.ndarray:
            return np.array(getattr(efforts(robot, settings.htmpc), symbol), float)

        def made(settings: VelocitySettings, value: float) -> list[float]:
            weights = now(settings)
            weights[joints] = value
            return weights.tolist()

        add_slider(
            self._gui,
            self._bindings,
            self._settings,
            label,
            path,
            (0.0, greatest, 0.01),
            lambda s: scalar(now(s)[joints].tolist()),
            "Weight of (10), the same for these joints",
            make=made,
            current=self._current,
        )

    def _limits(self) -> None:
        gui = self._gui
        with gui.add_folder("Limits"):
            for name in ("position", "velocity", "acceleration", "jerk"):
                add_box(
                    gui,
                    self._bindings,
                    self._settings,
                    name.capitalize(),
                    f"limits.{name}",
                    lambda s, name=name: bool(getattr(s.htmpc.limits, name)),
                )
            for name in ("velocity", "acceleration", "jerk"):
                add_slider(
                    gui,
                    self._bindings,
                    self._settings,
                    f"{name.capitalize()} scale",
                    f"limits.{name}_scale",
                    (0.1, 2.0, 0.05),
                    lambda s, name=name: float(getattr(s.htmpc.limits, f"{name}_scale")),
                    "Factor on the robot's own limits",
                )
            self._slider("Margin [cm]", "margin_m", (0, 50, 1), "Kept clear of obstacles, (7c)", 1e2)
            add_box(
                gui,
                self._bindings,
                self._settings,
                "Keep the arm clear of the base",
                "self_collision",
                lambda s: s.htmpc.self_collision,
            )

    def update(self, now: Snapshot[VelocitySettings]) -> None:
        settings = now.settings
        if settings.controller != self._shown:
            self._shown = settings.controller
            self._what.content = block(esc(VELOCITY_CONTROLLERS[self._shown]))
        htmpc = settings.htmpc
        self._ahead.content = block(
            f"Looks <b>{htmpc.horizon * htmpc.dt:.2g} s</b> ahead, every {1e3 * htmpc.period:.3g} ms."
        )
        step_ms, lag = 1e-3 * now.number("step_us"), settings.plant.latency_ms
        self._lag.content = block(
            f"Lag of the plant: <b>{lag:g} ms</b>{_compensated(settings)}. The last control step took "
            f"{step_ms:.1f} ms of {1e3 * htmpc.period:.3g} ms; "
            + ("the robot feels that, too." if settings.delay_measured else "simulated time waits for it.")
        )


def _compensated(settings: VelocitySettings) -> str:
    if settings.plant.latency_ms == 0.0 and not settings.delay_measured:
        return ""
    return ", predicted away" if settings.compensate_delay else ", not compensated"


def _of_htmpc(name: str) -> Callable[[VelocitySettings], Any]:
    return lambda settings: getattr(settings.htmpc, name)


def _at(values: tuple[float, ...], place: int) -> float:
    """The last value serves all further places."""
    return float(values[min(place, len(values) - 1)])


def _with(values: tuple[float, ...], place: int, value: float) -> list[float]:
    return [value if k == place else _at(values, k) for k in range(max(len(values), len(_GAINS)))]
