"""A plane through the QPs of the last tick, spanned by the increments of two joints."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from itertools import combinations
from typing import TYPE_CHECKING, Any

import numpy as np

from app.client.moment import Moment
from app.html.palette import BAD, BOUND, GHOST, RGB, css, ink
from app.html.svg import element, path, text
from app.html.text import block, esc, figure, joint_labels, swatch
from app.link.messages import Inside, InsideRequest
from app.panels.widgets.command import on_click
from app.panels.widgets.picture import SvgPicture
from app.tab.context import PageContext
from lessons.events import Set
from lessons.settings.torque import TorqueSettings

if TYPE_CHECKING:
    from lessons.geometry.plane import LevelCut, Plane

SIZE = (420, 408)
_LEFT, _TOP, _SIDE = 50.0, 10.0, 360.0
_SQUARE: dict[str, Any] = {"x": _LEFT, "y": _TOP, "width": _SIDE, "height": _SIDE}
_FAR = 6.0
"""The largest factor by which the unconstrained optimum of a level enlarges the picture."""
_SMALLEST = 0.12  # N·m: half the width at the largest magnification
_NEAR = 8.0
"""A side of the box enlarges the picture only if its distance is at most this multiple of the distance of the
farthest point."""
_LOOSE = 0.55
"""The picture shrinks only if it can shrink by this factor, so that small changes do not rescale it."""
_RINGS = (1.0, 2.0, 3.0)
CONTOURED = 2
"""Number of levels whose contours are drawn; lower levels usually have no freedom left in this plane."""
TITLE = "The QPs of this tick"
_APPLIED = "the applied Δτ"
_EMPTY = "No QP was solved yet: run (Space), or take one tick (T)."
_SHIFT = 1.0  # N·m


def half_width(plane: Plane, before: float | None) -> float:
    """Half the width of the picture, N·m, a round number; before: the previous half width."""
    near = [np.zeros(2), *(level.solved for level in plane.levels)]
    near += [each for each in (plane.weighted,) if each is not None]
    reach = max(_SMALLEST, *(float(np.abs(each).max()) for each in near))
    sides = np.abs(np.concatenate([plane.box.lower, plane.box.upper]))
    reach = max(reach, *(float(side) for side in sides if side <= _NEAR * reach), reach)
    wishes = [float(np.abs(level.centre).max()) for level in plane.levels[:CONTOURED]]
    reach = max(reach, *(min(wish, _FAR * max(reach, 0.1)) for wish in wishes), reach)
    wanted = _round(1.12 * reach)
    return before if before is not None and _LOOSE * before < wanted <= before else wanted


def _round(size: float) -> float:
    """Returns the next larger round number."""
    scale = 10.0 ** math.floor(math.log10(size))
    return next(
        scale * digit
        for digit in (1.0, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0, 10.0)
        if scale * digit >= size * (1 - 1e-12)
    )


class _Paper:
    """Converts points of the plane to coordinates of the picture."""

    def __init__(self, half: float) -> None:
        self.half, self.scale = half, 0.5 * _SIDE / half

    def x(self, value: float) -> float:
        return _LEFT + self.scale * (_bounded(value, self.half) + self.half)

    def y(self, value: float) -> float:
        return _TOP + self.scale * (self.half - _bounded(value, self.half))

    def seen(self, w: np.ndarray) -> bool:
        return bool((np.abs(w) <= self.half).all())


def _bounded(value: float, half: float) -> float:
    return min(max(value, -50.0 * half), 50.0 * half)


def parts(plane: Plane, half: float, colours: Mapping[str, RGB], joints: Sequence[str]) -> list[str]:
    """Returns SVG layers that change at different times, from back to front. joints: names of the joint of
    the horizontal axis and of the joint of the vertical axis."""
    paper = _Paper(half)
    clip = element("clipPath", element("rect", **_SQUARE), id="plane")
    inner = [_box(plane, paper)]
    for place, level in reversed(list(enumerate(plane.levels[:CONTOURED]))):
        inner.append(_contours(level, place, paper, colours))
    for place, level in enumerate(plane.levels[: max(len(plane.levels) - 1, 1)]):
        inner.append(_left(level, plane, place, paper, colours))
    return [
        element("defs", clip) + _axes(paper, joints),
        *(element("g", each, clip_path="url(#plane)") for each in inner),
        _sides(plane, paper),
        *_points(plane, paper, colours),
    ]


# -------------------------------------------------------------------- pieces


def _axes(paper: _Paper, joints: Sequence[str]) -> str:
    parts = [element("rect", **_SQUARE, fill="none", stroke=css(BOUND, 0.5))]
    bottom = _TOP + _SIDE
    for share in (-1.0, -0.5, 0.0, 0.5, 1.0):
        value = share * paper.half
        x, y = paper.x(value), paper.y(value)
        words = f"{value:.4g}".replace("-", "−")
        cross = f"M{x:.1f} {_TOP}V{bottom}M{_LEFT} {y:.1f}H{_LEFT + _SIDE}"
        parts.append(path(cross, stroke=css(BOUND, 0.6 if share == 0 else 0.2)))
        parts.append(text(x, bottom + 14, words, {1.0: "end", -1.0: "start"}.get(share, "middle")))
        parts.append(text(_LEFT - 4, y + 4, words, "end"))
    across, up = joints
    parts.append(text(_LEFT + 0.5 * _SIDE, bottom + 31, f"Δτ of {across}, N·m", "middle"))
    upwards = f"translate(11 {_TOP + 0.5 * _SIDE}) rotate(-90)"
    parts.append(text(0, 0, f"Δτ of {up}, N·m", "middle", transform=upwards))
    return "".join(parts)


def _corners(plane: Plane, paper: _Paper) -> tuple[float, float, float, float]:
    """Left, top, right and bottom of the box on the paper."""
    low, high = plane.box.lower, plane.box.upper
    return paper.x(low[0]), paper.y(high[1]), paper.x(high[0]), paper.y(low[1])


def _box(plane: Plane, paper: _Paper) -> str:
    left, top, right, bottom = _corners(plane, paper)
    if left > right or top > bottom:
        return ""
    around = f"M{_LEFT} {_TOP}h{_SIDE}v{_SIDE}h{-_SIDE}Z"
    inside = f"M{left:.1f} {top:.1f}V{bottom:.1f}H{right:.1f}V{top:.1f}Z"
    outside = path(around + inside, fill=css(BAD, 0.09), fill_rule="evenodd")
    return outside + path(inside, fill="none", stroke=css(BAD), stroke_width=1.6, class_="box")


def _sides(plane: Plane, paper: _Paper) -> str:
    """Returns the names of the limits at the visible sides of the box."""
    left, top, right, bottom = _corners(plane, paper)
    (w, e), (s, n) = plane.box.kinds
    x = min(max(0.5 * (left + right), _LEFT + 30), _LEFT + _SIDE - 30)
    y = min(max(0.5 * (top + bottom), _TOP + 30), _TOP + _SIDE - 30)
    parts = []
    for kind, at, seen, turned in (
        (w, (left + 11, y), left > _LEFT, True),
        (e, (right - 5, y), right < _LEFT + _SIDE, True),
        (n, (x, top + 12), top > _TOP, False),
        (s, (x, bottom - 5), bottom < _TOP + _SIDE, False),
    ):
        if kind is None or not seen:
            continue
        turn = f"translate({at[0]:.1f} {at[1]:.1f}){' rotate(-90)' if turned else ''}"
        parts.append(text(0, 0, kind, "middle", transform=turn, fill=ink(BAD)))
    return "".join(parts)


def _contours(level: LevelCut, place: int, paper: _Paper, colours: Mapping[str, RGB]) -> str:
    """Contours of the cost. One passes through the solution, where it touches the feasible set; the others
    show the shape of the cost."""
    colour = colours.get(level.name, BOUND)
    long, short, angle = level.ellipse(level.solved)
    touches = paper.scale * short > 4.0
    if not touches:  # the solution is the unconstrained minimum of the cost
        values, axes = np.linalg.eigh(level.P)
        short = 0.045 * paper.half
        long = short * math.sqrt(values[1] / values[0])
        angle = math.atan2(axes[1, 0], axes[0, 0])
    at = f"{paper.x(level.centre[0]):.1f} {paper.y(level.centre[1]):.1f}"
    parts = []
    for ring in (0.5, 1.0, 1.5) if touches else _RINGS:
        own = touches and ring == 1.0
        look = {"stroke": css(colour, 0.95 if own else 0.42), "stroke_width": 1.8 if own else 1.0}
        rx = min(paper.scale * ring * long, 9e4)
        parts.append(element("ellipse", rx=rx, ry=paper.scale * ring * short, **look))
    turn = f"translate({at}) rotate({-math.degrees(angle):.2f})"
    return element("g", "".join(parts), fill="none", class_=f"contours-{place + 1}", transform=turn)


def _left(level: LevelCut, plane: Plane, place: int, paper: _Paper, colours: Mapping[str, RGB]) -> str:
    """Returns the set that a level leaves to the levels below: a point, or a line that is thick within the
    box."""
    left, colour = level.leaves, css(colours.get(level.name, BOUND))
    if left.at is None or left.span.shape[1] == 2:
        return ""
    if left.span.shape[1] == 0:
        x, y = paper.x(left.at[0]), paper.y(left.at[1])
        cross = f"M{x - 9:.1f} {y:.1f}h18M{x:.1f} {y - 9:.1f}v18"
        return path(cross, stroke=colour, stroke_width=1.2, class_=f"left-{place + 1}")
    reach = 3.0 * paper.half + float(np.abs(left.at).max())
    ends = [left.at + s * left.span[:, 0] for s in (-reach, reach)]
    part = left.segment(plane.box)
    thin = path(_line(ends, paper), stroke=colour, stroke_width=1.4, stroke_dasharray="5 4")
    if part is None or not np.isfinite(part).all():
        return thin
    return thin + path(_line(part, paper), stroke=colour, stroke_width=3, class_=f"left-{place + 1}")


def _line(ends: Sequence[np.ndarray] | np.ndarray, paper: _Paper) -> str:
    (x, y), (to_x, to_y) = ((paper.x(end[0]), paper.y(end[1])) for end in ends)
    return f"M{x:.1f} {y:.1f}L{to_x:.1f} {to_y:.1f}"


def _points(plane: Plane, paper: _Paper, colours: Mapping[str, RGB]) -> list[str]:
    parts = []
    if plane.osf is not None:
        parts.append(_mark("osf", plane.osf, "OSF", BAD, "M0 -6L6 5H-6Z", paper, (0, -10)))
    for place, level in reversed(list(enumerate(plane.levels[:CONTOURED]))):
        colour = colours.get(level.name, BOUND)
        if np.abs(level.centre - level.solved).max() > 0.02 * paper.half:
            ring = "M-4 0a4 4 0 1 0 8 0a4 4 0 1 0 -8 0"
            name, words = f"wish-{place + 1}", f"{place + 1} alone"
            parts.append(_mark(name, level.centre, words, colour, ring, paper, (-8, -5), True))
    if plane.weighted is not None:
        parts.append(
            _mark("weighted", plane.weighted, "weighted", GHOST, "M0 -6L6 0L0 6L-6 0Z", paper, (8, 4))
        )
    for place, level in reversed(list(enumerate(plane.levels[:CONTOURED]))):
        colour, r = colours.get(level.name, BOUND), 5.5 - 1.5 * place
        disc = f"M{-r} 0a{r} {r} 0 1 0 {2 * r} 0a{r} {r} 0 1 0 {-2 * r} 0"
        shift = (-11, -7) if place == 0 else (8, 14)
        parts.insert(
            len(parts) - place,
            _mark(f"optimum-{place + 1}", level.solved, str(place + 1), colour, disc, paper, shift),
        )
    return parts


def _mark(
    name: str,
    w: np.ndarray,
    words: str,
    colour: RGB,
    shape: str,
    paper: _Paper,
    shift: tuple[float, float],
    hollow: bool = False,
) -> str:
    """Returns a mark at a point; if the point is outside the picture, an arrow at the edge points to it."""
    exact = ",".join(f"{value:.10g}" for value in w)
    if not np.isfinite(w).all():
        return ""
    if not paper.seen(w):
        share = 0.94 / float(np.abs(w / paper.half).max())
        x, y = paper.x(share * w[0]), paper.y(share * w[1])
        angle = -math.degrees(math.atan2(w[1], w[0]))
        words, shape, hollow = f"{words} {_figure(w)}", "M-9 -4L2 0L-9 4Z", False
        turn = f"rotate({angle:.0f})"
        anchor = "end" if x > _LEFT + 0.6 * _SIDE else "start" if x < _LEFT + 0.4 * _SIDE else "middle"
        dx, dy = {"end": -8, "start": 8, "middle": 0}[anchor], 18 if y < _TOP + 0.5 * _SIDE else -12
    else:
        x, y, turn, anchor = paper.x(w[0]), paper.y(w[1]), "", "end" if shift[0] < 0 else "start"
        dx, dy = shift
        if x > _LEFT + 0.85 * _SIDE and dx >= 0:
            anchor, dx = "end", -dx
    outline = {"fill": "none", "stroke": css(colour), "stroke_width": 1.6}
    mark = path(shape, transform=turn, **(outline if hollow else {"fill": css(colour)}))
    mark += text(dx, dy, words, anchor, fill=ink(colour), font_weight=600)
    return element("g", mark, class_=name, data_at=exact, transform=f"translate({x:.1f} {y:.1f})")


def _figure(w: np.ndarray) -> str:
    return f"({w[0]:.2g}, {w[1]:.2g})".replace("-", "−")


class PlanePanel:
    """The picture of the plane. It requests its data while the browser shows the picture."""

    def __init__(self, page: PageContext, levels: tuple[str, ...]) -> None:
        """levels: names, highest priority first. In a lesson, which has a text of its own, the legend is
        folded."""
        gui, robot = page.gui, page.robot
        self._colours = page.colours
        self._half: float | None = None
        self._names = joint_labels(robot.joint_names)
        self._pairs = {
            f"{self._names[a]}, {self._names[b]}": (a, b) for a, b in combinations(range(robot.n), 2)
        }
        self._picture = SvgPicture(page.client, page.in_view, TITLE, SIZE, _EMPTY)
        self._why_not = gui.add_html("")
        with gui.add_folder("Legend", expand_by_default=not page.in_lesson) as self._folder:
            self._words = gui.add_html("")
        self._fewer = gui.add_button(
            "Look one knot ahead (N = 1)",
            visible=False,
            hint="The QP then has fewer variables, and the plane of two joints shows more of it",
        )
        with gui.add_folder("Which joints", expand_by_default=False):
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

        on_click(self._fewer, lambda: page.post(Set("horizon", 1)))

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
        inside = moment.status.inside
        plane = None if inside is None else inside.plane
        if plane is None or not self._picture.in_view:
            return
        self._half = half_width(plane, self._half)
        names = [self._names[joint] for joint in plane.joints]
        self._picture.paint(parts(plane, self._half, self._colours, names))

    def write(self, inside: Inside | None, settings: TorqueSettings) -> None:
        """Updates the legend, which also says how closely the geometry and the solver agree."""
        if inside is None or not self._picture.in_view:
            return
        several = settings.horizon > 1 and settings.controller != "hiqp"
        self._fewer.visible = several
        drawn = inside.plane is not None
        why_not = "" if drawn else block(esc(inside.why_not))
        self._why_not.content, self._folder.visible = why_not, drawn
        words = "" if inside.plane is None else self._legend(inside.plane, several)
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
