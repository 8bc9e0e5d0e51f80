"""Converts `now` to numbers on the lab's side, and back in the process of the submission."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from math import prod
from types import SimpleNamespace
from typing import Any, final

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Ask = Callable[[str, int, list[Array]], Array]
"""A call of a function of the model on the lab's side, by its name, the number of the level, and
arguments."""

OF_TICK = ("q", "q_dot", "q_ddot", "tau_0", "M_bar", "M", "bias", "gravity")
OF_BOUNDS = ("tau_lower", "tau_upper", "v_lower", "v_upper", "q_lower", "q_upper")
OF_NEAR = ("d", "gradient", "d_safe", "moving")
OF_LEVEL = ("error", "x_dot", "x_ddot", "J", "J_dot_q_dot", "displacement_d", "x_dot_d", "x_ddot_d",
            "K_p", "K_v", "Q", "R")  # fmt: skip
OF_FURTHER = ("profile", "directions", "lower", "upper")
"""The names of the arrays of `himpc.controllers.view`, in the order in which they are sent."""


def numbers_of(now: Any) -> list[Array]:
    """Returns the arrays of a `View`, in this order."""
    bounds = now.bounds
    numbers = [getattr(now, name) for name in OF_TICK]
    numbers += [getattr(bounds, name) for name in OF_BOUNDS]
    numbers += [getattr(now.near, name) for name in OF_NEAR]
    for level in now.levels:
        numbers += [getattr(level, name) for name in OF_LEVEL]
        numbers += level.x.values()
    for further in now.further:
        numbers += [getattr(further, name) for name in OF_FURTHER]
    return numbers


def shape_of(now: Any) -> dict[str, Any]:
    """Returns the data needed to read the arrays: names, shapes, and the values that are not arrays."""
    return {
        "T_s": now.T_s,
        "N": now.N,
        "bounds": [now.bounds.approach, now.bounds.paper],
        "near": [now.near.names, now.near.reaction, now.near.deceleration],
        "levels": [[level.name, level.tasks, list(level.x), level.horizon] for level in now.levels],
        "further": len(now.further),
        "shapes": [array.shape for array in numbers_of(now)],
    }


def _read_only(_: object, name: str, __: Any) -> None:
    raise AttributeError(f"the data of a controller are read-only: {name} cannot be set")


@final
class Part(SimpleNamespace):
    """A level, the bounds, or the distances. The names of the attributes are those of the HIMPC paper."""

    __setattr__ = _read_only


@final
class Now(SimpleNamespace):
    """The attributes of `himpc.controllers.view.View`, in a process that cannot import it."""

    __setattr__ = _read_only
    q: Array
    levels: tuple[Part, ...]

    @property
    def n(self) -> int:
        """Number of joints."""
        return self.q.size

    def level(self, name: str) -> Part:
        """Returns the level with this name. Raises KeyError with the names of all levels."""
        for level in self.levels:
            if level.name == name:
                return level
        raise KeyError(f"no level '{name}' is on: there are {', '.join(level.name for level in self.levels)}")


def rebuilt(shape: dict[str, Any], data: bytes, ask: Ask) -> Now:
    """Returns `now` of a tick, with read-only arrays.

    Args:
        shape: the result of `shape_of` for the `View`.
        data: the numbers of its arrays, one after the other.
        ask: function that calls a function of the model.
    """
    numbers, arrays, at = np.frombuffer(data, float), [], 0
    for sides in shape["shapes"]:
        end = at + prod(sides)
        arrays.append(numbers[at:end].reshape(sides))
        at = end
    following = iter(arrays)
    tick = {name: next(following) for name in OF_TICK}
    approach, paper = shape["bounds"]
    bounds = Part(**{name: next(following) for name in OF_BOUNDS}, approach=approach, paper=paper)
    names, reaction, deceleration = shape["near"]
    near = Part(
        **{name: next(following) for name in OF_NEAR},
        names=tuple(names),
        reaction=reaction,
        deceleration=deceleration,
    )
    levels = []
    for index, (name, tasks, values, horizon) in enumerate(shape["levels"]):
        parts: dict[str, Any] = {field: next(following) for field in OF_LEVEL}
        parts["x"] = {key: next(following) for key in values}
        parts["jacobian"] = partial(_fetch, ask, "jacobian", index)
        levels.append(Part(name=name, tasks=tuple(tasks), horizon=horizon, **parts))
    further = [Part(**{field: next(following) for field in OF_FURTHER}) for _ in range(shape["further"])]
    nominal = Part(mass_matrix=partial(_fetch, ask, "mass_matrix", 0), bias=partial(_fetch, ask, "bias", 0))
    return Now(
        **tick,
        T_s=shape["T_s"],
        N=shape["N"],
        levels=tuple(levels),
        bounds=bounds,
        near=near,
        further=tuple(further),
        nominal=nominal,
    )


def _fetch(ask: Ask, name: str, level: int, *args: Any) -> Array:
    return ask(name, level, [np.asarray(argument, float) for argument in args])
