"""Plots of inputs (torques or accelerations), velocities and positions with their bounds: all joints as
shares of their bounds, or one joint in its units."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from app.client.recording import PlotWindow
from app.html.palette import BAD, BOUND, GOOD, ink, joint_colour, joint_dash
from app.html.text import block, joints_named
from app.panels.widgets.chart import ChartLine, Charts, Plot
from app.tab.context import PageContext
from robots import Robot
from robots.joints import joint_axis

_ALL = "All joints, % of bound"
_SHARE = 120.0  # %: the axis reaches slightly beyond the bounds
_HEIGHT = 170  # px
_BOUNDS = (
    ChartLine("upper bound", BOUND, dashed=True),
    ChartLine("lower bound", BOUND, dashed=True),
    ChartLine("at bound", BAD, fill=0.5, width=0.5),
)
_RUG = 0.035  # height of the mark "at its bound", as a share of the axis


@dataclass(frozen=True, eq=False)
class _Quantity:
    """values, lower, upper: (rows, n), NaN where unknown. Where a bound is off, lower and upper contain the
    bound of the data sheet."""

    values: np.ndarray
    lower: np.ndarray
    upper: np.ndarray

    def shares(self) -> np.ndarray:
        """Returns (rows, n): how far the values are from the middle between their bounds, % of half the
        distance between the bounds."""
        middle, half = 0.5 * (self.upper + self.lower), 0.5 * (self.upper - self.lower)
        return 100.0 * (self.values - middle) / np.where(half > 0, half, np.inf)


@dataclass(frozen=True)
class Input:
    """The input of the joints: fields of the telemetry (value, lower bound, upper bound), and the units for
    revolute and for prismatic joints. If `lower` is None, the lower bound is −upper."""

    title: str
    value: str
    lower: str | None
    upper: str
    units: tuple[str, str]


Sheet = tuple[tuple[np.ndarray, np.ndarray], ...]
TORQUE = Input("Torque", "tau", "tau_lower", "tau_upper", ("N·m", "N"))
ACCELERATION = Input("Acceleration, largest", "acceleration", None, "a_limit", ("rad/s²", "m/s²"))


class JointPlots:
    """Three charts. The callback only stores the choice; the page's loop builds and draws the charts."""

    def __init__(self, page: PageContext, driven: Input = TORQUE) -> None:
        gui, robot = page.gui, page.robot
        self._robot, self._input = robot, driven
        self._sheet = data_sheet(robot, driven)
        self._prismatic = [joint_axis(robot.model, joint)[0] for joint in robot.joints]
        options = (_ALL, *map(joints_named, robot.joint_names))
        choice = gui.add_dropdown("Joints", options, initial_value=_ALL)
        self._charts = Charts(page)
        gui.add_html(
            block(
                "The range within the bounds is shaded. If a bound is off, the data sheet's bound is used. "
                f'A <b style="color:{ink(BAD)}">red mark</b> at the bottom: a shown joint is at its bound.'
            )
        )
        self._chosen: Callable[[], int] = lambda: options.index(str(choice.value)) - 1

    def draw(self, window: PlotWindow, ghost: PlotWindow | None) -> None:
        """ghost: the ghost's data over the same interval, drawn dashed."""
        joint = self._chosen()
        kinds = range(3)
        plots = [
            self._all(kind, ghost is not None) if joint < 0 else self._one(kind, joint) for kind in kinds
        ]
        self._charts.draw(plots, window, ghost)

    def _all(self, kind: int, ghost: bool) -> Plot:
        """Returns the chart of all joints. One legend is enough for the three charts. With a ghost there is
        no legend, as a legend would name each joint twice."""
        names = self._robot.joint_names

        def shares(window: PlotWindow) -> list[np.ndarray]:
            return list(quantity(window, self._input, self._sheet, kind).shares().T)

        def marked(window: PlotWindow) -> list[np.ndarray]:
            known = np.isfinite(quantity(window, self._input, self._sheet, kind).values[:, 0])
            edge = np.where(known, 100.0, np.nan)
            return [edge, -edge, _rug(window.at_bound(kind).any(axis=1), -_SHARE, _SHARE)]

        return Plot(
            f"{self._titles[kind]}, % of bound",
            (-_SHARE, _SHARE),
            tuple(
                ChartLine(_short(name, k), joint_colour(k), dash=joint_dash(k))
                for k, name in enumerate(names)
            ),
            shares,
            _BOUNDS,
            marked,
            log=False,
            bands=((len(names), len(names) + 1, GOOD),),
            height=_HEIGHT,
            legend=kind == 2 and not ghost,
        )

    def _one(self, kind: int, joint: int) -> Plot:
        unit, factor = self._unit(kind, joint)
        span = self._span(kind, joint)

        def values(window: PlotWindow) -> list[np.ndarray]:
            return [factor * quantity(window, self._input, self._sheet, kind).values[:, joint]]

        def marked(window: PlotWindow) -> list[np.ndarray]:
            own = quantity(window, self._input, self._sheet, kind)
            bounds = [factor * each[:, joint] for each in (own.upper, own.lower)]
            return [*bounds, _rug(window.at_bound(kind)[:, joint], *span)]

        return Plot(
            f"{self._titles[kind]}, {unit}",
            span,
            (ChartLine(joints_named(self._robot.joint_names[joint]), joint_colour(joint), width=2.0),),
            values,
            _BOUNDS,
            marked,
            log=False,
            bands=((1, 2, GOOD),),
            height=_HEIGHT,
            legend=kind == 2,
        )

    @property
    def _titles(self) -> tuple[str, str, str]:
        return self._input.title, "Velocity", "Position"

    def _unit(self, kind: int, joint: int) -> tuple[str, float]:
        """Returns the unit on the axis and the factor from the SI unit."""
        turning, sliding = self._input.units
        if self._prismatic[joint]:
            return ((sliding, 1.0), ("m/s", 1.0), ("m", 1.0))[kind]
        return ((turning, 1.0), ("°/s", np.degrees(1.0)), ("°", np.degrees(1.0)))[kind]

    def _span(self, kind: int, joint: int) -> tuple[float, float]:
        factor = self._unit(kind, joint)[1]
        lower, upper = (factor * float(side[joint]) for side in self._sheet[kind])
        margin = 0.1 * (upper - lower)
        return lower - margin, upper + margin


def quantity(window: PlotWindow, driven: Input, sheet: Sheet, kind: int) -> _Quantity:
    """Returns the input (kind 0), velocity (1) or position (2) of all joints with its bounds. sheet: see
    `data_sheet`."""
    columns, fields = window.columns, window.layout.fields
    field, low, high = (
        (driven.value, driven.lower, driven.upper),
        ("v", None, "v_limit"),
        ("q", "q_lower", "q_upper"),
    )[kind]
    upper = columns(fields[high])
    lower = -upper if low is None else columns(fields[low])
    return _Quantity(
        columns(fields[field]),
        np.where(np.isfinite(lower), lower, sheet[kind][0]),
        np.where(np.isfinite(upper), upper, sheet[kind][1]),
    )


def _rug(at_bound: np.ndarray | np.bool_, low: float, high: float) -> np.ndarray:
    """Returns the marks at the bottom of a chart while a joint is at its bound."""
    return np.where(at_bound, low + _RUG * (high - low), low)


def data_sheet(robot: Robot, driven: Input) -> Sheet:
    """Returns the bounds of the robot's data sheet; ± one turn for a joint without position bounds."""
    own = robot.tau_limit if driven is TORQUE else robot.a_max
    u = np.where(np.isfinite(own), own, 1e3)
    v = np.where(np.isfinite(robot.v_limit), robot.v_limit, 1e2)
    return (
        (-u, u),
        (-v, v),
        (
            np.where(np.isfinite(robot.q_lower), robot.q_lower, -2 * np.pi),
            np.where(np.isfinite(robot.q_upper), robot.q_upper, 2 * np.pi),
        ),
    )


def _short(name: str, index: int) -> str:
    name = joints_named(name)
    return name if len(name) <= 8 else f"joint {index + 1}"
