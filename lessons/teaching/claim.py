"""A claim: a sentence about a run that a measurement shows to be true or false."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

from lessons.teaching.measure import Measure

Relation = Literal["at most", "at least"]
_SIGNS: dict[Relation, str] = {"at most": "≤", "at least": "≥"}


@dataclass(frozen=True)
class Claim:
    """A sentence, the number that decides it, and the bound on that number.

    Attributes:
        text: the sentence, for the learner.
        measure: the number.
        relation: whether the number must be "at most" or "at least" the bound.
        bound: bound on the number, in the unit of the measure.
        fails_with: assignments "PATH=VALUE", in addition to those of the step, under which the sentence is
            false. Goals of a challenge have none: they are not met at its start.
        because: why the sentence is false under these assignments, in a few words.
    """

    text: str
    measure: Measure
    relation: Relation
    bound: float
    fails_with: tuple[str, ...] = ()
    because: str = ""

    def holds(self, value: float) -> bool:
        """Returns whether a measured value fulfils the claim; False for NaN."""
        return holds(value, self.relation, self.bound)

    @property
    def condition(self) -> str:
        """The claim as an inequality, e.g. "≤ 1 mm"."""
        return condition(self.relation, self.bound, self.measure.unit)


def holds(value: float, relation: Relation, bound: float) -> bool:
    """Returns whether a value is at most, or at least, a bound; False for NaN."""
    return value <= bound if relation == "at most" else value >= bound


def condition(relation: Relation, bound: float, unit: str) -> str:
    """Returns the condition as an inequality, e.g. "≤ 1 mm"."""
    return f"{_SIGNS[relation]} {bound:g} {unit}".rstrip()
