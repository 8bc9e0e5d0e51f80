"""The controls and the script of events of a step, as data."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from lessons.events import Event
from lessons.settings.settings import SceneSettings

Script = tuple[tuple[float, Event], ...]
"""A script: (time in s, event) in order. A torque-level scene accepts only the events of `lessons.events`."""


@dataclass(frozen=True)
class Control:
    """A setting that the learner can change in a step.

    Attributes:
        path: as in `lessons.settings.settings.Settings.changed`.
        words: its label.
        low, high: the ends of a slider; for a number only.
        log: the slider is logarithmic; low > 0.
        choices: the values of a menu, which replaces the slider; (False, True) gives a switch.
    """

    path: str
    words: str
    low: float = 0.0
    high: float = 0.0
    log: bool = False
    choices: tuple[Any, ...] = ()

    def __post_init__(self) -> None:
        if not self.choices and not self.low < self.high:
            raise ValueError(f"control '{self.path}' needs choices or low < high")
        if self.log and self.low <= 0:
            raise ValueError(f"control '{self.path}' is logarithmic: low must be above 0")

    def takes(self, value: Any) -> bool:
        """Returns whether the control can be set to a value."""
        if self.choices:
            return value in self.choices
        return isinstance(value, (int, float)) and self.low <= value <= self.high


def chosen(settings: SceneSettings, control: Control) -> Any:
    """Returns the choice of a control that is equal to the present setting; None if no choice is equal to
    it."""
    fitting = (choice for choice in control.choices if settings.changed(control.path, choice) == settings)
    return next(fitting, None)


def within(settings: SceneSettings, control: Control) -> bool:
    """Returns whether the control can set the present value of the setting."""
    if control.choices:
        return chosen(settings, control) is not None
    return control.takes(settings.value_at(control.path))
