"""A derivation whose every equation is tried on numbers, and questions whose answers compute theirs."""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Sides = Callable[[np.random.Generator], tuple[ArrayLike, ArrayLike]]

LINK = 0.3
"""Of the planar arm, m; it has three."""

_HOLE = re.compile(r"⟨(\w+)⟩")
_MEASURED = Path(__file__).parents[1] / "site" / "measured.json"


@dataclass(frozen=True)
class Line:
    """One step of a derivation.

    Attributes:
        words: why it follows.
        equation: in LaTeX.
        sides: both of its sides for random numbers, by ways of their own where there are two.
        tolerance: by how much they may differ, relative to the larger and absolutely.
    """

    words: str
    equation: str
    sides: Sides
    tolerance: float = 1e-9


@dataclass(frozen=True)
class Question:
    """An exercise on paper.

    Attributes:
        asked: the question.
        answer: with ⟨name⟩ where a number stands.
        numbers: name: value and how it is written. It has no number that neither stands here nor is given
            in the question or the lesson.
    """

    asked: str
    answer: str
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)

    @property
    def answered(self) -> str:
        """The answer with its numbers. Raises KeyError for one that is not computed."""
        return _HOLE.sub(lambda hole: format(*self.numbers[hole[1]]), self.answer)


@dataclass(frozen=True)
class Further:
    """What belongs to one lesson."""

    derivation: tuple[Line, ...]
    questions: tuple[Question, Question, Question]


def measured(lesson: str, claim: str, there: bool = False) -> float:
    """What `himpc-lab lessons --check` measured for the claim that begins so; there: under its wrong setting.
    Raises KeyError if there is no such claim or no number."""
    for check in _checks().get(lesson, ()):
        if check["what"].startswith(claim):
            return float(check["measured_there" if there else "measured"])
    raise KeyError(f"'{lesson}' has no claim '{claim}'")


@cache
def _checks() -> dict[str, list[dict[str, Any]]]:
    told = json.loads(_MEASURED.read_text(encoding="utf-8"))
    return {each["name"]: each["checks"] for each in told["lessons"]}


def planar(q: ArrayLike) -> tuple[Array, Array]:
    """The planar arm's hand (2,), m, and its Jacobian (2, 3) at q (3,), rad."""
    angles = np.cumsum(np.asarray(q, float))
    ends = LINK * np.array([np.cos(angles), np.sin(angles)])
    turned = np.array([-ends[1], ends[0]])
    return ends.sum(axis=1), np.cumsum(turned[:, ::-1], axis=1)[:, ::-1]


def inertia(rng: np.random.Generator, n: int) -> Array:
    """Some symmetric positive definite matrix (n, n)."""
    root = rng.normal(size=(n, n))
    return root @ root.T + n * np.eye(n)


def null_space(J: Array) -> Array:
    """Columns that span what J (m, n) maps to zero, (n, n − rank), orthonormal."""
    _, size, rows = np.linalg.svd(J)
    return rows[int((size > 1e-10).sum()) :].T
