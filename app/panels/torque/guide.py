"""The guide of the Start tab: what to try first in a torque-level scene, adapted to its stack."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from app.html.palette import BOUND, RGB
from app.html.text import block, esc, swatch
from app.link.messages import TaskView
from app.view.coordinates import draggable
from himpc.stack import Level


def guide(
    tasks: tuple[TaskView, ...], levels: Sequence[Level], colours: Mapping[str, RGB], dragged: bool
) -> str:
    """Returns HTML that suggests what to try next, with the present names and places of the levels.

    Args:
        tasks: the tasks of the stack.
        levels: all levels of the stack; disabled levels keep their places.
        colours: the colour of each level.
        dragged: whether the target has been dragged, so that the next suggestion is shown.
    """
    places = {level.name: place for place, level in enumerate(levels, start=1) if level.enabled}
    position = draggable(tasks)[0]
    if position is None:
        return _paragraph(*_following(tasks, places))
    return _paragraph(*(_next(places) if dragged else _first(position, places, colours)))


def _first(position: TaskView, places: Mapping[str, int], colours: Mapping[str, RGB]) -> tuple[str, str]:
    ball = f"The arrows are at the {swatch(colours.get(position.level, BOUND))}ball"
    if position.level not in places:
        return _DRAG, f"{ball}. The ball's level is switched off: switch it on in <b>Tasks</b>."
    own = places[position.level]
    axes = " and ".join(position.axes) if position.axes != "xyz" else ""
    told = [
        f"{ball}, and the robot follows{f' in {axes}' if axes else ''}: this is "
        f"the task of {_name(position.level, own)}."
    ]
    above = {name: place for name, place in places.items() if place < own}
    below = {name: place for name, place in places.items() if place > own}
    if above:
        told.append(f"Above it {'is' if len(above) == 1 else 'are'} {_listed(above)}.")
    if below:
        told.append(
            f"Below it {_listed(below)} {'gets' if len(below) == 1 else 'get'} only the freedom that is left."
        )
    return _DRAG, " ".join(told)


def _following(tasks: tuple[TaskView, ...], places: Mapping[str, int]) -> tuple[str, str]:
    off = (
        "Then switch a level off in the tab <b>Tasks</b>" if places else "Add a level in the tab <b>Tasks</b>"
    )
    rest = f"{off}, or push the robot below, and see which errors grow."
    if any(task.kind == "position" for task in tasks):  # its target follows a curve and cannot be dragged
        return "Watch the hand follow the curve.", rest
    return "Push the robot below.", f"{off}, and see which errors grow."


def _next(places: Mapping[str, int]) -> tuple[str, str]:
    rest = "drag the target out of reach, push the robot below, or put 5 kg on its hand in <b>Plant</b>."
    if len(places) < 2:
        return "Now add a task.", f"Add a level in the tab <b>Tasks</b>, {rest}"
    (top, first), (lower, place), *_ = places.items()
    told = (
        f"Open <b>Tasks</b> (or press {place}) and switch off {_name(lower, place)}: its error may grow. "
        f"Does the error of {_name(top, first)} change? Then {rest}"
    )
    return "Now switch a level off.", told


_DRAG = "Drag the target by its arrows."


def _name(level: str, place: int) -> str:
    return f"<b>{esc(spoken(level))}</b> (level {place})"


def _listed(places: Mapping[str, int]) -> str:
    return " and ".join(_name(level, place) for level, place in places.items())


def spoken(level: str) -> str:
    """Returns the name of a level as words."""
    return level.replace("+", " and ").replace("_", " ")


def _paragraph(head: str, rest: str) -> str:
    return block(f'<div style="font-size:1.15em"><b>{head}</b></div>{rest}', "padding-top:0.5em")
