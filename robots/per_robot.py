"""`per_robot`: results that are computed once for each robot and deleted together with it."""

from __future__ import annotations

from collections.abc import Callable
from functools import wraps
from typing import Any, Concatenate, ParamSpec, TypeVar
from weakref import WeakKeyDictionary

from robots.robot import Robot

P = ParamSpec("P")
Result = TypeVar("Result")


def per_robot(compute: Callable[Concatenate[Robot, P], Result]) -> Callable[Concatenate[Robot, P], Result]:
    """Stores the results of a function of a robot and other hashable arguments for as long as the robot
    exists.

    A server builds a new robot for every page that opens a scene. With `functools.lru_cache`, hundreds of
    unused robots would stay in memory. The results must not refer to the robot.
    """
    results: WeakKeyDictionary[Robot, dict[Any, Result]] = WeakKeyDictionary()

    @wraps(compute)
    def once(robot: Robot, *arguments: P.args, **named: P.kwargs) -> Result:
        key, known = (arguments, tuple(named.items())), results.setdefault(robot, {})
        if key not in known:
            known[key] = compute(robot, *arguments, **named)
        return known[key]

    return once
