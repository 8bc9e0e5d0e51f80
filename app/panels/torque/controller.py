"""The controller: which one, horizon, M̄ with its gauge, time step, limits, solver."""

from __future__ import annotations

import viser

from app.html.palette import BAD, GOOD
from app.html.text import bar, block, esc, formula
from app.panels.torque.deadline import DeadlineFolder
from app.panels.widgets.mirror import Bindings
from app.panels.widgets.sliders import add_slider
from app.panels.widgets.snapshot import Snapshot
from himpc.catalog import CONTROLLERS
from lessons.events import Set
from lessons.session.bumpless import HANDOVER_SECONDS
from lessons.settings.torque import TorqueSettings
from lessons.settings.values import choices_of
from robots import Robot


class ControllerPanel:
    """Everything about the controller that can be changed while it runs."""

    def __init__(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings, robot: Robot
    ) -> None:
        self._choice(gui, bindings, settings)
        self._horizon(gui, bindings, settings)
        self._deadline = DeadlineFolder(gui, bindings, settings)
        self._inertia(gui, bindings, settings, robot)
        self._limits(gui, bindings, settings)
        self._solver(gui, bindings, settings)

    def _choice(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings
    ) -> None:
        with gui.add_folder("Which controller"):
            menu = gui.add_dropdown(
                "Controller",
                tuple(CONTROLLERS),
                initial_value=settings.controller,
                hint="Switch while the robot moves: in "
                f"{HANDOVER_SECONDS:g} s the torque goes over from one controller to the other",
            )
            self._what = gui.add_html(block(esc(CONTROLLERS[settings.controller])))
        self._shown = settings.controller
        bindings.bind(menu, lambda s: s.controller, lambda name: Set("controller", str(name)))

    def _horizon(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings
    ) -> None:
        with gui.add_folder("Horizon"):
            knots = gui.add_slider(
                "N",
                min=1,
                max=max(30, settings.horizon),
                step=1,
                initial_value=settings.horizon,
                hint="Knots the controller looks ahead; 1 is the inverse dynamics hierarchy",
            )
            add_slider(
                gui,
                bindings,
                settings,
                "T_s [ms]",
                "T_s",
                (0.5, 5.0, 0.5),
                lambda s: s.T_s,
                "Control period, and the budget of every control step",
                unit=1e3,
            )
        bindings.bind(knots, lambda s: s.horizon, lambda value: Set("horizon", int(value)))

    def _inertia(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings, robot: Robot
    ) -> None:
        with gui.add_folder("Inertia guess M̄"):
            self._gauge = gui.add_html("")
            add_slider(
                gui,
                bindings,
                settings,
                "M̄ scale",
                "M_bar_scale",
                (0.1, 5.0, 0.05),
                lambda s: s.M_bar_scale,
                "One factor on the whole diagonal of M̄",
            )
            with gui.add_folder("Per joint, kg·m²", expand_by_default=False):
                for joint in range(robot.n):
                    with gui.add_folder(None):
                        value = float(settings.M_bar[joint])
                        number = gui.add_number(
                            robot.joint_names[joint], value, min=min(1e-6, value), step=_nice_step(value)
                        )
                    bindings.bind(
                        number,
                        lambda s, joint=joint: float(s.M_bar[joint]),
                        lambda value, joint=joint: Set(f"M_bar.{joint + 1}", float(value)),
                    )

    def _limits(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings
    ) -> None:
        limits = settings.limits
        with gui.add_folder("Limits"):
            torque = gui.add_checkbox("Torque", limits.torque)
            velocity = gui.add_checkbox("Velocity", limits.velocity)
            position = gui.add_dropdown(
                "Position",
                choices_of(type(limits), "position"),
                initial_value=limits.position,
                hint="viability: a speed from which the joint can still stop. paper: the rows as printed, "
                "which a few milliseconds of horizon cannot keep: the list of rungs shows it.",
            )
            for name, field in (("Torque", "torque_scale"), ("Velocity", "velocity_scale")):
                add_slider(
                    gui,
                    bindings,
                    settings,
                    f"{name} scale",
                    f"limits.{field}",
                    (0.05, 2.0, 0.01),
                    lambda s, field=field: float(getattr(s.limits, field)),
                    f"One factor on the robot's {name.lower()} limits",
                )
        bindings.bind(torque, lambda s: s.limits.torque, lambda on: Set("limits.torque", bool(on)))
        bindings.bind(velocity, lambda s: s.limits.velocity, lambda on: Set("limits.velocity", bool(on)))
        bindings.bind(position, lambda s: s.limits.position, lambda mode: Set("limits.position", str(mode)))

    def _solver(
        self, gui: viser.GuiApi, bindings: Bindings[TorqueSettings], settings: TorqueSettings
    ) -> None:
        with gui.add_folder("Solver", expand_by_default=False):
            for label, path, hint in (
                ("Route", "route", "Two ways to the same torque"),
                ("QP solver", "solver", "For the QPs with active bounds; qpoases needs the extra 'bench'"),
                ("R weighs", "R_on", "Δτ as printed, or M̄⁻¹Δτ"),
            ):
                with gui.add_folder(None):
                    choice = gui.add_dropdown(
                        label,
                        choices_of(type(settings), path),
                        initial_value=str(getattr(settings, path)),
                        hint=hint,
                    )
                bindings.bind(
                    choice,
                    lambda s, path=path: str(getattr(s, path)),
                    lambda value, path=path: Set(path, str(value)),
                )
        with gui.add_folder("Why M̄ matters", expand_by_default=False):
            gui.add_html(
                formula(r"\tau = \tau_0 + \bar M (\ddot q - \ddot q_0)")
                + block("Time-delay estimation: the torque and acceleration of the tick before stand for the "
                        "whole dynamics, M̄ for the inertia. The estimation error dies out if")
                + formula(r"\rho(I - M^{-1} \bar M) < 1")
            )  # fmt: skip

    def update(self, now: Snapshot[TorqueSettings]) -> None:
        self._deadline.update(now)
        if now.settings.controller != self._shown:
            self._shown = now.settings.controller
            self._what.content = block(esc(CONTROLLERS[self._shown]))
        norm, radius = now.number("gauge_norm"), now.number("gauge_radius")
        self._gauge.content = block(
            f"spectral radius of I − M⁻¹M̄: <b>{radius:.3f}</b>{_verdict(radius)}"
            f"{bar(radius / 2, GOOD if radius < 1 else BAD, 0.5)}"
            f"norm ‖I − M⁻¹M̄‖₂: <b>{norm:.3f}</b>{_verdict(norm)}"
            f"{bar(norm / 2, GOOD if norm < 1 else BAD, 0.5)}"
            "The line marks 1. Below it the estimation error dies out; a norm below 1 says so at once, "
            "the radius decides."
        )


def _verdict(value: float) -> str:
    return "" if value != value else " &lt; 1 ✓" if value < 1 else " ≥ 1"


def _nice_step(value: float) -> float:
    """A tenth of the value's decade: one click is a visible change whatever the joint's size."""
    return 10.0 ** (len(f"{1 / max(value, 1e-6):.0f}") * -1.0) if value < 1 else 0.1
