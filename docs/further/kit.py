"""Data types for derivations, whose equations a test evaluates on random numbers, and for questions with
computed answers."""

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
"""Length of each of the three links of the planar arm, m."""

_HOLE = re.compile(r"⟨(\w+)⟩")
_MEASURED = Path(__file__).parents[1] / "site" / "measured.json"


@dataclass(frozen=True)
class Line:
    """One step of a derivation.

    Attributes:
        words: the reason for the step.
        equation: the equation in LaTeX.
        sides: returns both sides of the equation for random numbers, computed independently where possible.
        tolerance: the allowed difference between the sides, both relative and absolute.
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
        answer: the answer; ⟨name⟩ marks the place of a number.
        numbers: the value and the format of each name. All other numbers of the answer appear in the question
            or in the lesson.
    """

    asked: str
    answer: str
    numbers: Mapping[str, tuple[float, str]] = field(default_factory=dict)

    @property
    def answered(self) -> str:
        """The answer with all its numbers inserted. Raises KeyError for a name that is not in `numbers`."""
        return _HOLE.sub(lambda hole: format(*self.numbers[hole[1]]), self.answer)


@dataclass(frozen=True)
class Further:
    """The derivation and the questions of one lesson."""

    derivation: tuple[Line, ...]
    questions: tuple[Question, Question, Question]


def measured(lesson: str, claim: str, there: bool = False) -> float:
    """Returns the value that `himpc-lab lessons --check` measured for the claim whose text begins with
    `claim`. With `there`, it returns the value under the setting that makes the claim fail. Raises KeyError
    if the lesson has no such claim."""
    for check in _checks().get(lesson, ()):
        if check["what"].startswith(claim):
            return float(check["measured_there" if there else "measured"])
    raise KeyError(f"'{lesson}' has no claim '{claim}'")


@cache
def _checks() -> dict[str, list[dict[str, Any]]]:
    told = json.loads(_MEASURED.read_text(encoding="utf-8"))
    return {each["name"]: each["checks"] for each in told["lessons"]}


def planar(q: ArrayLike) -> tuple[Array, Array]:
    """Returns the position (2,), m, of the planar arm's hand and its Jacobian (2, 3) at q (3,), rad."""
    angles = np.cumsum(np.asarray(q, float))
    ends = LINK * np.array([np.cos(angles), np.sin(angles)])
    turned = np.array([-ends[1], ends[0]])
    return ends.sum(axis=1), np.cumsum(turned[:, ::-1], axis=1)[:, ::-1]


def inertia(rng: np.random.Generator, n: int) -> Array:
    """Returns a random symmetric positive definite matrix (n, n)."""
    root = rng.normal(size=(n, n))
    return root @ root.T + n * np.eye(n)


def null_space(J: Array) -> Array:
    """Returns an orthonormal basis of the null space of J (m, n) as columns, (n, n − rank)."""
    _, size, rows = np.linalg.svd(J)
    return rows[int((size > 1e-10).sum()) :].T
