"""One array of numbers and one of whole numbers hold all that a tick reads and writes; names and shapes are
data."""

from __future__ import annotations

from math import prod
from types import ModuleType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]
Whole = Any
"""Whole numbers, NDArray[np.intp]: an element of them is a number, which type checkers do not know."""

# Sizes: n joints, N knots, N1 = N + 1; M rows of all tasks, m of those that are solved; r levels; T tasks;
# F frames; G rows that are given; J = n + 1 places, the world first; b rows of bounds (kinds · N); w = N · n
# coordinates of a level, and k = w + 1 rows that can hold its point, one of them about to be replaced.
NUMBERS = {
    # What a tick is given.
    "q": "n",
    "v": "n",
    "tau_0": "n",
    "x_d": "M",
    "R_d": "T 3 3",
    "motion": "3 N1 M",  # x_d(k+j) − x_d(k), ẋ_d and ẍ_d
    "given": "N1 G n",
    "curve": "M 4",
    "pace": "T 2",
    # What is remembered from the tick before.
    "q_was": "n",
    "v_was": "n",
    "x_dot_was": "M",
    "path": "N1 n",
    "warm_multiplier": "r k",
    "U_was": "r N n",
    # The settings.
    "M_bar": "n",
    "K_p": "M",
    "K_v": "M",
    "root_Q": "M",
    "C": "M N",
    "S": "M N N",
    "on_velocity": "N M",
    "on_acceleration": "N M",
    "rho": "r",
    "metric": "r n",
    "R": "r n",
    "accuracy": "r",
    "limits": "8 n",
    "L": "b N",
    "approach": "N",
    "scalars": "4",
    # The robot.
    "rotation": "J 3 3",
    "translation": "J 3",
    "axis": "J 3",
    "frame_rotation": "F 3 3",
    "frame_translation": "F 3",
    # What a tick finds; one piece, so that a plan takes its copy at once.
    "tau": "n",
    "U": "r N n",
    "predicted": "N1 n",
    "value": "M",
    "error": "M",
    "R_now": "T 3 3",
    "lower": "b n",
    "upper": "b n",
    "stopping": "2 n",
    "cost": "r",
    "kkt": "r",
    "leak": "r",
    "multiplier": "r k",
    "slack": "r k",
    # What else telemetry tells of it; nothing is NaN.
    "quaternion": "T 4",
    "quaternion_d": "T 4",
    "delta_tau": "n",
    "at_bound": "n",
    "priority_leak": "1",
    "active": "r",
    "rung": "r",
    "time_us": "r",
    "nothing": "1",
    # Scratch.
    "placed": "J 12",
    "axis_now": "J 3",
    "point": "F 3",
    "x_dot": "M",
    "B": "N M n",
    "free": "N M",
    "Q": "N n n",
    "reflector": "N n n",
    "projected_jacobian": "N M n",
    "fixed": "N n",
    "e_0": "N M",
    "e_1": "N M",
    "pushed": "N M",
    "H": "w w",
    "low": "b n",
    "high": "b n",
    "reached": "b n",
    "length": "b n",
    "effect": "r N M",
    "normal": "k w",
    "scaled_normal": "k w",
    "orthonormal_basis": "k w",
    "cholesky_factor": "k k",
    "target": "k",
    "violation": "k",
    "trial_multiplier": "k",
    "change": "k",
    "x": "w",
    "z": "w",
    "slope": "w",
    "ideal": "w",
    "size": "2",
    "budget": "1",
}
"""Every array of numbers and its shape."""

WHOLES = {
    "sizes": "11",
    # What is remembered, and whether `x_dot_was` and `U_was` are known.
    "known": "2",
    "warm_row": "r k",
    "warm_joint": "r k",
    "warm_count": "r",
    # The settings.
    "task": "T 4",
    "part": "M",
    "law": "T",
    "row_knots": "M",
    "level": "r 8",
    # The robot.
    "parent": "J",
    "is_revolute": "J",
    "frame_joint": "F",
    # What a tick finds.
    "active_row": "r k",
    "active_joint": "r k",
    "active_count": "r",
    "left": "r",
    # Scratch.
    "count": "N",
    "start": "N",
    "offset": "N1",
    "rest": "N1",
    "held_row": "k",
    "held_joint": "k",
    "held_side": "k",
}
"""Every array of whole numbers and its shape."""


def _numbered(name: str, shapes: dict[str, str]) -> Any:
    """The place of every array among all. A module: what that holds is a constant to the compiler, which
    would write a whole tuple down anew wherever one of its numbers is used."""
    places = ModuleType(name)
    vars(places).update({each: place for place, each in enumerate(shapes)})
    return places


AT, WHOLE_AT = _numbered("AT", NUMBERS), _numbered("WHOLE_AT", WHOLES)
"""Where in `Arena.where` and `Arena.whole_where` the place of an array is noted."""

PERIOD, T_S, REACTION, NOW = range(4)
"""What `scalars` holds: s since the tick before, s until the next one, the reaction of `viable_speed`, t."""

_LINE = 8
"""Arrays begin at multiples of so many numbers: a line of the processor's cache."""


class Arena:
    """The numbers of one controller.

    Attributes:
        data, whole: all numbers, all whole numbers.
        where, whole_where: at which of them each array begins, in the order of `AT` and `WHOLE_AT`.
        f, i: the arrays by name, views into `data` and `whole`.
        arguments: what compiled functions take.
    """

    def __init__(self, **sizes: int) -> None:
        """sizes: by the letters of the shapes."""
        self.data, self.where, self.f = _laid_out(NUMBERS, sizes, np.float64)
        self.whole, self.whole_where, self.i = _laid_out(WHOLES, sizes, np.intp)
        self.arguments = (self.data, self.where, self.whole, self.whole_where)
        begin, end = self.where[[AT.tau, AT.placed]].tolist()
        whole_begin, whole_end = self.whole_where[[WHOLE_AT.active_row, WHOLE_AT.count]].tolist()
        self._found = slice(begin, end), slice(whole_begin, whole_end)

    def found(self) -> Snapshot:
        """What this tick found, which stays when the next one comes."""
        numbers, wholes = self._found
        return Snapshot(self, self.data[numbers].copy(), self.whole[wholes].copy())

    def read(self, snapshot: Snapshot, name: str) -> Any:
        """An array of a snapshot."""
        whole = name in WHOLES
        at, view = (WHOLE_AT, self.i) if whole else (AT, self.f)
        start = (self.whole_where if whole else self.where)[getattr(at, name)] - self._found[whole].start
        shape = view[name].shape
        return (snapshot.whole if whole else snapshot.data)[start : start + prod(shape)].reshape(shape)


class Snapshot(NamedTuple):
    """A copy of what a tick found."""

    arena: Arena
    data: Array
    whole: Whole

    def __call__(self, name: str) -> Any:
        """The array of this name."""
        return self.arena.read(self, name)


def _laid_out(shapes: dict[str, str], sizes: dict[str, int], kind: type) -> tuple:
    where, views, end = np.zeros(len(shapes), np.intp), {}, 0
    sized = {
        name: tuple(sizes[s] if s in sizes else int(s) for s in shape.split())
        for name, shape in shapes.items()
    }
    for place, shape in enumerate(sized.values()):
        where[place] = end
        end += -(-prod(shape) // _LINE) * _LINE
    data = np.zeros(end, kind)
    for (name, shape), start in zip(sized.items(), where.tolist(), strict=True):
        views[name] = data[start : start + prod(shape)].reshape(shape)
    return data, where, views
