"""Moves targets with the keyboard: the arrow keys change a field by one step, and buttons turn a target."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence

import numpy as np
import viser

from app.panels.widgets.command import on_change, on_click
from app.panels.widgets.controls import in_colours_of_axes
from app.tab.mirror import HOLD
from app.view.targets import Movable

_STEPS = {"1 mm": 1e-3, "1 cm": 1e-2, "5 cm": 5e-2}
_FIRST = "1 cm"
_DIGITS = 3  # digits after the decimal point of a length in m
_ANGLE = 5.0  # degrees
_TURNS = {
    f"{sign}{axis}": (place, side) for place, axis in enumerate("xyz") for sign, side in (("−", -1), ("+", 1))
}
_NONE: tuple[str, ...] = ("–",)


class MovePanel:
    """A folder with a field for each coordinate of a target. The arrow keys up and down change a field by the
    chosen step. If a number is typed, the target moves to this coordinate."""

    def __init__(self, gui: viser.GuiApi, movables: Callable[[], Sequence[Movable]]) -> None:
        """movables: returns the present targets; it is first called after the targets are drawn."""
        self._movables = movables
        self._touched = -float("inf")
        with gui.add_folder("Move a target by keys", expand_by_default=False):
            self._which = gui.add_dropdown("Target", _NONE)
            self._step = gui.add_dropdown(
                "Step",
                tuple(_STEPS),
                initial_value=_FIRST,
                hint="The change of a coordinate when you press an arrow key, up or down",
            )
            self._fields = [
                gui.add_number(
                    f"Target {axis} [m]",
                    0.0,
                    step=_STEPS[_FIRST],
                    hint="Along a world axis. Arrow keys up and down: one step",
                )
                for axis in "xyz"
            ]
            self._turn = gui.add_button_group(
                "Turn", tuple(_TURNS), hint=f"By {_ANGLE:g}° about a world axis through the target"
            )
            gui.add_html(in_colours_of_axes(self._turn))
        for field in self._fields:
            on_change(field, self._moved)

        @self._step.on_update
        async def _(_: object) -> None:
            for field in self._fields:
                field.step = _STEPS[str(self._step.value)]

        on_click(self._turn, lambda: self._turned(str(self._turn.value)))

    def _chosen(self) -> Movable | None:
        return next((each for each in self._movables() if each.name == self._which.value), None)

    def _moved(self) -> None:
        chosen = self._chosen()
        if chosen is None or chosen.move is None:
            return
        self._touched = time.monotonic()
        chosen.move(np.array([float(field.value) for field in self._fields]))

    def _turned(self, label: str) -> None:
        chosen = self._chosen()
        if chosen is not None and chosen.turn is not None:
            place, side = _TURNS[label]
            chosen.turn(side * np.radians(_ANGLE) * np.eye(3)[place])

    def update(self) -> None:
        """Shows the present targets and the position of the chosen target; called on viser's loop."""
        names = tuple(each.name for each in self._movables()) or _NONE
        if self._which.options != names:
            self._which.options = names
        chosen = self._chosen()
        at = None if chosen is None else chosen.place()
        movable = chosen is not None and chosen.move is not None
        turns = chosen is not None and chosen.turn is not None
        self._turn.visible = turns
        for field, value in zip(self._fields, np.zeros(3) if at is None else at, strict=True):
            field.visible = movable
            shown = round(float(value), _DIGITS)
            # A field that was just used keeps its value, even if the robot's reach limits the target.
            if at is not None and time.monotonic() - self._touched > HOLD and field.value != shown:
                field.value = shown
