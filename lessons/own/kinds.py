"""Determines the kind of a user's file."""

from __future__ import annotations

from collections.abc import Callable
from types import ModuleType
from typing import Any, Literal, get_args

from robots import InputError

Kind = Literal["controller", "scene", "task", "exercise"]
KINDS: tuple[Kind, ...] = get_args(Kind)

_DEFINES: dict[Kind, str] = {
    "controller": "a function torque(now) or a class Controller with a method torque(self, now)",
    "scene": "SCENE, or a function scene() that returns one",
    "task": "TASK",
    "exercise": "EXERCISE = own_exercise(…)",
}


def kind_of(module: ModuleType) -> Kind:
    """Returns the kind of a file. Raises InputError if it defines none of the kinds, or several."""
    path, names = module.__file__, vars(module)
    defined: dict[Kind, bool] = {
        "controller": "torque" in names or "Controller" in names,
        "scene": "SCENE" in names or callable(names.get("scene")),
        "task": "TASK" in names,
        # In a student's solution, EXERCISE is only the name of an exercise.
        "exercise": not isinstance(names.get("EXERCISE", ""), str),
    }
    kinds: list[Kind] = [kind for kind in KINDS if defined[kind]]
    if not kinds:
        raise InputError(
            f"{path}: defines neither a controller nor a scene, task or exercise: "
            + "; ".join(f"{_a(kind)} is {what}" for kind, what in _DEFINES.items())
        )
    if len(kinds) > 1:
        raise InputError(f"{path}: defines a {' and a '.join(kinds)}: put each into a file of its own")
    return kinds[0]


def expected(module: ModuleType, kind: Kind) -> None:
    """Raises InputError if a file is not of the expected kind."""
    actual = kind_of(module)
    if actual != kind:
        raise InputError(f"{module.__file__}: is {_a(actual)}, but {_a(kind)} is needed: {_DEFINES[kind]}")


def _a(kind: Kind) -> str:
    return f"{'an' if kind == 'exercise' else 'a'} {kind}"


def law_of(module: ModuleType) -> Callable[[], Callable[[Any], Any]]:
    """Returns the function that creates the control law of a file. Raises InputError if the file defines
    none."""
    expected(module, "controller")
    names = vars(module)
    if "Controller" in names:
        made = names["Controller"]
        if not isinstance(made, type) or not callable(getattr(made, "torque", None)):
            raise InputError(f"{module.__file__}: Controller must be a class with a method torque(self, now)")
        return lambda: made().torque
    law = names["torque"]
    if not callable(law):
        raise InputError(f"{module.__file__}: torque must be a function torque(now) that returns the torque")
    return lambda: law


def line_of(module: ModuleType) -> int:
    """Returns the number of the first line of the function `torque` in a controller's file."""
    made = vars(module).get("Controller")
    law = vars(module).get("torque") if made is None else getattr(made, "torque", None)
    code = getattr(law, "__code__", None)
    return 1 if code is None else code.co_firstlineno
