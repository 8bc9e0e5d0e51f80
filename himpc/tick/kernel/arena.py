"""An arena: one array of real numbers and one of integers with all data that a tick reads and writes. Tables
contain the names and shapes of its parts."""

from __future__ import annotations

from math import prod
from typing import Any, NamedTuple

import numpy as np

from himpc.tick.kernel.arrays import AT, NUMBERS, WHOLE_AT, WHOLES, Array, IntArray, Sizes

_LINE = 8
"""Arrays begin at multiples of this number of elements: a line of the processor's cache."""


class Arena:
    """The numbers of one controller.

    Attributes:
        data, whole: all floating-point numbers; all integers.
        where, whole_where: index in `data` and `whole` at which each array begins, in the order of `AT` and
            `WHOLE_AT`.
        f, i: the arrays by name, views into `data` and `whole`.
        arguments: the four arrays that compiled functions receive: data, where, whole and whole_where.
    """

    def __init__(self, sizes: Sizes) -> None:
        self.data, self.where, self.f = laid_out(NUMBERS, sizes._asdict(), np.float64)
        self.whole, self.whole_where, self.i = laid_out(WHOLES, sizes._asdict(), np.intp)
        self.arguments = (self.data, self.where, self.whole, self.whole_where)
        begin, end = self.where[[AT["tau"], AT["placed"]]].tolist()
        whole_begin, whole_end = self.whole_where[[WHOLE_AT["active_row"], WHOLE_AT["end"]]].tolist()
        self._results = slice(begin, end), slice(whole_begin, whole_end)

    def snapshot(self) -> Snapshot:
        """Returns a copy of the results of this tick, which the next tick does not change."""
        numbers, wholes = self._results
        return Snapshot(self, self.data[numbers].copy(), self.whole[wholes].copy())

    def read(self, snapshot: Snapshot, name: str) -> Any:
        """Returns an array of a snapshot."""
        whole = name in WHOLES
        at, view = (WHOLE_AT, self.i) if whole else (AT, self.f)
        start = (self.whole_where if whole else self.where)[at[name]] - self._results[whole].start
        shape = view[name].shape
        return (snapshot.whole if whole else snapshot.data)[start : start + prod(shape)].reshape(shape)


class Snapshot(NamedTuple):
    """A copy of the results of a tick."""

    arena: Arena
    data: Array
    whole: IntArray

    def __call__(self, name: str) -> Any:
        """Returns the array of this name."""
        return self.arena.read(self, name)


def laid_out(shapes: dict[str, str], sizes: dict[str, int], kind: type) -> tuple:
    """Returns one array for all numbers, the index at which each named array begins in it, and the named
    arrays.

    Args:
        shapes: the shape of each array, by name.
        sizes: the value of each letter in the shapes.
        kind: the type of a number.
    """
    where, views, end = np.zeros(len(shapes), np.intp), {}, 0
    sized = {
        name: tuple(sizes[s] if s in sizes else int(s) for s in shape.split())
        for name, shape in shapes.items()
    }
    for index, shape in enumerate(sized.values()):
        where[index] = end
        end += -(-prod(shape) // _LINE) * _LINE
    data = np.zeros(end, kind)
    for (name, shape), start in zip(sized.items(), where.tolist(), strict=True):
        views[name] = data[start : start + prod(shape)].reshape(shape)
    return data, where, views
