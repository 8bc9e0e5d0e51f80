"""The active constraints of the last plan, and the time that each joint spent at its bounds."""

from __future__ import annotations

from app.html.palette import BOUND
from app.html.text import block, esc, joints_named, swatch
from app.tab.context import PageContext, SessionSnapshot
from himpc.limits import CONSTRAINTS
from lessons.settings.settings import SceneSettings

_ALWAYS = 3
"""Constraints that every robot has: torque, velocity and position. Other constraints get a column once they
bind."""
_HEAD = '<tr style="text-align:left">{}</tr>'


class BindingPanel:
    """Two tables: the active constraints, and the time at bounds."""

    def __init__(self, page: PageContext) -> None:
        gui, self._colours = page.gui, page.colours
        gui.add_html(
            block("A bound <b>binds</b> (is active) when the plan stops at it. The multiplier is the rate at "
                  "which the level's cost would fall if the bound were moved outwards. For costs without the "
                  "factor ½, such as (31), the rate is twice the multiplier. The slack is the distance by "
                  "which the bound was softened.")
        )  # fmt: skip
        with gui.add_folder("Binding now"):
            self._now = gui.add_html("")
        with gui.add_folder("Time at bounds since the reset"):
            self._times = gui.add_html("")

    def update(self, now: SessionSnapshot[SceneSettings]) -> None:
        rows = "".join(
            f"<tr><td>{swatch(self._colours.get(row.level, BOUND))}{esc(row.level)}</td>"
            f"<td>{esc(readable(row.joint))}</td><td>{esc(row.kind)} {esc(row.side)}</td>"
            f"<td>{row.multiplier:.3g}</td><td>{row.slack:.2g}</td></tr>"
            for row in now.status.binding
        )
        nearest = f"<p>Nearest pair: {esc(readable(now.status.nearest))}.</p>" if now.status.nearest else ""
        self._now.content = block(
            nearest + _table(("level", "joint or pair", "bound", "multiplier", "slack"), rows)
            if rows
            else f"No bound is binding: every level is limited only by the levels above it.{nearest}"
        )
        robot = now.ready.robot
        shown = [place for place in range(now.bound_seconds.shape[1])
                 if place < _ALWAYS or now.bound_seconds[:, place].any()]  # fmt: skip
        spent = "".join(
            f"<tr><td>{esc(readable(name))}</td>"
            + "".join(f"<td>{s:.2f} s</td>" for s in seconds[shown])
            + "</tr>"
            for name, seconds in zip(robot.joint_names, now.bound_seconds, strict=True)
            if seconds.any()
        )
        titles = ("joint", *(CONSTRAINTS[place].label for place in shown))
        self._times.content = block(_table(titles, spent) if spent else "None so far.")


def readable(pair: str) -> str:
    """Returns the names of a pair as words, "link 5 – table" for "link_5 – table", or that of a joint."""
    return pair.replace("_", " ") if " – " in pair else joints_named(pair)


def _table(titles: tuple[str, ...], rows: str) -> str:
    head = _HEAD.format("".join(f'<th style="padding-right:0.8em">{title}</th>' for title in titles))
    table = f'<table style="border-spacing:0.3em 0.1em">{head}{rows}</table>'
    return f'<div tabindex="0" style="overflow-x:auto">{table}</div>'
