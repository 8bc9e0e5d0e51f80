"""A plane through the QPs of the last tick, spanned by the increments of two joints."""

from __future__ import annotations

from itertools import combinations
from typing import TYPE_CHECKING

import viser

from app.client.moment import Moment
from app.client.pending_edit import Send
from app.html.palette import BAD, BOUND, GHOST, RGB, ink
from app.html.text import block, esc, figure, swatch
from app.link.inside import Inside, InsideRequest
from app.panels.inside.plane_svg import CONTOURED, SIZE, half_width, parts
from app.panels.widgets.command import on_click
from app.panels.widgets.in_view import InView
from app.panels.widgets.picture import SvgPicture
from lessons.events import Set
from lessons.settings.torque import TorqueSettings
from robots import Robot

if TYPE_CHECKING:
    from lessons.geometry.plane import Plane

TITLE = "The QPs of this tick"
_APPLIED = "the applied Δτ"
_EMPTY = "No QP was solved yet: run (Space), or take one tick (T)."
_SHIFT = 1.0  # N·m


class PlanePanel:
    """The picture of the plane. It requests its data while the browser shows the picture."""

    def __init__(
        self,
        client: viser.ClientHandle,
        in_view: InView,
        robot: Robot,
        levels: tuple[str, ...],
        colours: dict[str, RGB],
        post: Send,
    ) -> None:
        """levels: names, highest priority first; post: posts an event to the session."""
        gui = client.gui
        self._robot, self._colours = robot, colours
        self._half: float | None = None
        self._pairs = {
            f"{robot.joint_names[a]}, {robot.joint_names[b]}": (a, b)
            for a, b in combinations(range(robot.n), 2)
        }
        self._picture = SvgPicture(client, in_view, TITLE, SIZE, _EMPTY)
        self._words = gui.add_html("")
        self._fewer = gui.add_button(
            "Look one knot ahead (N = 1)",
            visible=False,
            hint="The QP then has fewer variables, and the plane of two joints shows more of it",
        )
        with gui.add_folder("Choice of the plane", expand_by_default=False):
            self._pair = gui.add_dropdown(
                "Joints",
                tuple(self._pairs),
                hint="The joint of the horizontal axis, then the joint of the vertical axis",
            )
            self._through = gui.add_dropdown(
                "Other Δτ held at",
                (_APPLIED, *levels),
                hint="The Δτ of other joints and of later knots have the values of this level's solution",
            )
            self._shift = gui.add_slider(
                "Offset [N·m]",
                min=-_SHIFT,
                max=_SHIFT,
                step=0.01,
                initial_value=0.0,
                hint="Offset of the other joints' Δτ from this solution",
            )

        on_click(self._fewer, lambda: post(Set("horizon", 1)))

    @property
    def wish(self) -> InsideRequest:
        """The data that are requested from the simulation; empty while the picture is not visible."""
        if not self._picture.in_view:
            return InsideRequest()
        through = str(self._through.value)
        return InsideRequest(
            plane=self._pairs.get(str(self._pair.value)),
            through="" if through == _APPLIED else through,
            shift=min(max(float(self._shift.value), -_SHIFT), _SHIFT),
        )

    def draw(self, moment: Moment) -> None:
        """Draws the data of an instant."""
        inside = moment.status.inside
        plane = None if inside is None else inside.plane
        if plane is None or not self._picture.in_view:
            return
        self._half = half_width(plane, self._half)
        names = [self._robot.joint_names[joint] for joint in plane.joints]
        self._picture.paint(parts(plane, self._half, self._colours, names))

    def write(self, inside: Inside | None, settings: TorqueSettings) -> None:
        """Updates the legend, which also says how closely the geometry and the solver agree."""
        if inside is None or not self._picture.in_view:
            return
        several = settings.horizon > 1 and settings.controller != "hiqp"
        if self._fewer.visible != several:
            self._fewer.visible = several
        words = block(esc(inside.why_not)) if inside.plane is None else self._legend(inside.plane, several)
        if self._words.content != words:
            self._words.content = words

    def _legend(self, plane: Plane, several: bool) -> str:
        lines = []
        for place, level in enumerate(plane.levels[:CONTOURED]):
            left = (
                ("a point", "a line", "all")[level.leaves.span.shape[1]]
                if level.leaves.at is not None
                else "–"
            )
            lines.append(
                f"{swatch(self._colours.get(level.name, BOUND))}<b>{place + 1} {esc(level.name)}</b>: "
                f"contours of its cost, and a disc at its optimum; (33) leaves {left}"
            )
        lines.append(
            f'<span style="color:{ink(BAD)}">▭</span> the box of the bounds; the red area violates a bound'
        )
        lines.append(
            f'<span style="color:{ink(GHOST)}">◆</span> optimum of one weighted cost, without priorities'
        )
        if plane.osf is not None:
            outside = "outside the box" if not plane.box.inside(plane.osf) else "inside the box in this tick"
            lines.append(f'<span style="color:{ink(BAD)}">▲</span> the increment of OSF: {outside}')
        lines.append(f"Geometry and solver agree to <b>{figure(max(plane.apart, 1e-16), 'N·m')}</b>.")
        if several:
            lines.append("Later knots are held at their values in the solution.")
        return block("<br>".join(lines))
