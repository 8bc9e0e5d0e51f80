"""Plots of inputs (torques or accelerations), velocities and positions with their bounds: all joints as
shares of their bounds, or one joint in its units."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np

from app.client.recording import PlotWindow
from app.html.palette import BAD, BOUND, GOOD, ink, joint_colour, joint_dash
from app.html.text import block, joints_named
from app.panels.widgets.chart import Chart, ChartLine, of_ghost
from app.tab.context import PageContext
from robots import Robot
from robots.joints import joint_axis

_ALL = "All joints, % of bound"
_SHARE = 120.0  # %: the axis reaches slightly beyond the bounds
_RUG = 0.035  # height of the mark "at its bound", as a share of the axis


@dataclass(frozen=True, eq=False)
class _Quantity:
    """values, lower, upper: (rows, n), NaN where unknown. Where a bound is off, lower and upper contain the
    bound of the data sheet."""

    title: str
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
        self._gui, self._in_view = gui, page.in_view
        self._robot, self._input = robot, driven
        self._sheet = data_sheet(robot, driven)
        self._prismatic = [joint_axis(robot.model, joint)[0] for joint in robot.joints]
        self._joint: int | None = None
        self._built: tuple[int | None, bool] | None = None
        self._charts: list[Chart] = []
        options = (_ALL, *map(joints_named, robot.joint_names))
        choice = gui.add_dropdown("Joints", options, initial_value=_ALL)
        self._place = gui.add_folder(None)
        gui.add_html(
            block(
                "The range within the bounds is shaded. If a bound is off, the data sheet's bound is used. "
                f'A <b style="color:{ink(BAD)}">red mark</b> at the bottom: a shown joint is at its bound.'
            )
        )

        @choice.on_update
        async def _(_: object) -> None:
            index = options.index(str(choice.value)) - 1
            self._joint = None if index < 0 else index

    def draw(self, window: PlotWindow, ghost: PlotWindow | None) -> None:
        """ghost: the ghost's data over the same interval, drawn dashed."""
        joint = self._joint
        if (joint, ghost is not None) != self._built:
            self._build(joint, ghost is not None)
        if not any(chart.in_view for chart in self._charts):
            return
        beside = [None] * 3 if ghost is None else quantities(ghost, self._input, self._sheet)
        own = quantities(window, self._input, self._sheet)
        for kind, (chart, *found) in enumerate(zip(self._charts, own, beside, strict=True)):
            chart.show(window, partial(self._curves, window.at_bound(kind), kind, joint, *found))

    def _curves(
        self, at_bound: np.ndarray, kind: int, joint: int | None, own: _Quantity, other: _Quantity | None
    ) -> list[np.ndarray]:
        """Returns the curves of a chart: values, upper and lower bound, marks at the bottom, and the ghost's
        values."""
        if joint is None:
            edge = np.where(np.isfinite(own.values[:, 0]), 100.0, np.nan)
            low, high = -_SHARE, _SHARE
            lines = [*own.shares().T, edge, -edge]
            dashed = [] if other is None else list(other.shares().T)
            marked = at_bound.any(axis=1)
        else:
            low, high = self._span(kind, joint)
            unit = self._unit(kind, joint)[1]
            lines = [unit * each[:, joint] for each in (own.values, own.upper, own.lower)]
            dashed = [] if other is None else [unit * other.values[:, joint]]
            marked = at_bound[:, joint]
        return [*lines, np.where(marked, low + _RUG * (high - low), low), *dashed]

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

    def _build(self, joint: int | None, ghost: bool) -> None:
        for chart in self._charts:
            chart.remove()
        names = self._robot.joint_names
        with self._place:
            self._charts = [
                self._all(title, names, kind == 2, ghost)
                if joint is None
                else self._one(title, kind, joint, ghost)
                for kind, title in enumerate((self._input.title, "Velocity", "Position"))
            ]
        self._built = joint, ghost

    def _all(self, title: str, names: tuple[str, ...], last: bool, ghost: bool) -> Chart:
        n = len(names)
        lines = [
            ChartLine(_short(name, k), joint_colour(k), dash=joint_dash(k)) for k, name in enumerate(names)
        ]
        bounds = [ChartLine("upper bound", BOUND, dashed=True), ChartLine("lower bound", BOUND, dashed=True)]
        return Chart(
            self._gui,
            self._in_view,
            f"{title}, % of bound",
            [*lines, *bounds, ChartLine("at bound", BAD, fill=0.5, width=0.5), *of_ghost(lines, ghost)],
            (-_SHARE, _SHARE),
            height=170,
            bands=((n, n + 1, GOOD),),
            # One legend is enough for the three charts. With a ghost there is no legend, as a legend would
            # name each joint twice.
            legend=last and not ghost,
        )

    def _one(self, title: str, kind: int, joint: int, ghost: bool) -> Chart:
        line = ChartLine(joints_named(self._robot.joint_names[joint]), joint_colour(joint), width=2.0)
        return Chart(
            self._gui,
            self._in_view,
            f"{title}, {self._unit(kind, joint)[0]}",
            [
                line,
                ChartLine("upper bound", BOUND, dashed=True),
                ChartLine("lower bound", BOUND, dashed=True),
                ChartLine("at bound", BAD, fill=0.5, width=0.5),
                *of_ghost([line], ghost),
            ],
            self._span(kind, joint),
            height=170,
            bands=((1, 2, GOOD),),
            legend=kind == 2,
        )


def quantities(window: PlotWindow, driven: Input, sheet: Sheet) -> list[_Quantity]:
    """Returns input, velocity and position of all joints with their bounds. sheet: see `data_sheet`."""
    columns, fields = window.columns, window.layout.fields
    v, upper = columns(fields["v_limit"]), columns(fields[driven.upper])
    lower = -upper if driven.lower is None else columns(fields[driven.lower])
    found = (
        (driven.title, driven.value, lower, upper),
        ("Velocity", "v", -v, v),
        ("Position", "q", columns(fields["q_lower"]), columns(fields["q_upper"])),
    )
    return [
        _Quantity(
            title,
            columns(fields[field]),
            np.where(np.isfinite(lower), lower, sheet_lower),
            np.where(np.isfinite(upper), upper, sheet_upper),
        )
        for (title, field, lower, upper), (sheet_lower, sheet_upper) in zip(found, sheet, strict=True)
    ]


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
