"""A poll: many people answer the prediction of a step, once or twice, before the run decides it."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass, replace

from lessons.teaching.prediction import Choice, Value
from robots import InputError

ROUNDS = 2
"""Number of rounds: a first vote, and a second vote after a discussion."""
VOTERS = 2000
"""Largest number of people who can vote in one poll."""
_BARS = 8  # bars of a histogram of numbers


@dataclass(frozen=True)
class Bar:
    """A bar of a histogram.

    Attributes:
        label: the option, or the interval of numbers.
        count: number of votes.
        right: whether the measured number belongs to this bar; None before the number is known.
    """

    label: str
    count: int
    right: bool | None = None


@dataclass(frozen=True)
class Poll:
    """The votes on one question. A vote is the index of an option of a `Choice` or the number that a `Value`
    asks for.

    Attributes:
        question: the question.
        rounds: for each round, the votes by voter; the present round is the last.
        is_open: whether the present round accepts votes.
    """

    question: Choice | Value
    rounds: tuple[Mapping[str, float], ...] = ({},)
    is_open: bool = True

    @property
    def latest(self) -> Mapping[str, float]:
        """The votes of the present round."""
        return self.rounds[-1]

    def with_vote(self, voter: str, answer: object) -> Poll:
        """Returns the poll after a vote. A voter's later vote replaces the earlier one.

        Raises:
            InputError: the vote is closed, this question has no such answer, or there are too many voters.
        """
        if not self.is_open:
            raise InputError("the vote is closed: your answer was not counted")
        vote = valid(self.question, answer)
        if voter not in self.latest and len(self.latest) >= VOTERS:
            raise InputError(f"{VOTERS} people have voted: this vote accepts no more voters")
        if self.latest.get(voter) == vote:
            return self
        return replace(self, rounds=(*self.rounds[:-1], {**self.latest, voter: vote}))

    def closed(self) -> Poll:
        """Returns the poll with its present round closed. Closing a closed poll changes nothing."""
        return replace(self, is_open=False)

    def again(self) -> Poll:
        """Returns the poll with one more round. Raises InputError while a round is open, and after the last
        round."""
        if self.is_open:
            raise InputError("the vote is open: close it before the second vote")
        if len(self.rounds) >= ROUNDS:
            raise InputError("the second vote of this step is over: run the step, or choose another one")
        return replace(self, rounds=(*self.rounds, {}), is_open=True)

    def favourite(self) -> float:
        """Returns the most frequent option, or the median of numbers. Without votes, returns the first
        option, or the middle of the scale."""
        votes = sorted(self.latest.values())
        match self.question:
            case Choice():
                return Counter(votes).most_common(1)[0][0] if votes else 0
            case Value() as value:
                return votes[len(votes) // 2] if votes else math.sqrt(value.low * value.high)

    def right(self, truth: float, number: int = -1) -> int | None:
        """Returns how many votes of a round are right for the measured number; None if nothing was
        measured."""
        hits = [self.question.hits(vote, truth) for vote in self.rounds[number].values()]
        known = self.question.hits(self.favourite(), truth) is not None
        return sum(map(bool, hits)) if known else None


def valid(question: Choice | Value, answer: object) -> float:
    """Returns the answer as a vote. Raises InputError if this question has no such answer."""
    match question:
        case Choice() if type(answer) is int and 0 <= answer < len(question.options):
            return answer
        case Choice():
            raise InputError(f"this is not an option: choose one of the {len(question.options)} options")
        case Value() as value:
            if isinstance(answer, (int, float)) and not isinstance(answer, bool):
                slack = 1 + 1e-9  # the ends of a slider have rounding errors
                if value.low / slack <= answer <= value.high * slack:
                    return float(min(max(answer, value.low), value.high))
            raise InputError(
                f"the answer must be a number from {value.low:g} to {value.high:g} {value.measure.unit}"
            )


def histogram(poll: Poll, number: int = -1, truth: float = math.nan) -> tuple[Bar, ...]:
    """Returns the bars of a round, by default the present one: one per option, or intervals of equal width on
    the logarithmic scale. truth: the measured number; NaN if it is not known."""
    question, votes = poll.question, poll.rounds[number].values()
    match question:
        case Choice():
            counts = Counter(map(int, votes))
            right = question.right(truth)
            return tuple(
                Bar(option.text, counts[k], None if right is None else k == right)
                for k, option in enumerate(question.options)
            )
        case Value() as value:
            counts = Counter(_bar_index(value, vote) for vote in votes)
            known = math.isfinite(truth) and truth > 0
            right = _bar_index(value, min(max(truth, value.low), value.high)) if known else None
            return tuple(
                Bar(_interval(value, k), counts[k], None if right is None else k == right)
                for k in range(_BARS)
            )


def _bar_index(value: Value, vote: float) -> int:
    share = math.log(vote / value.low) / math.log(value.high / value.low)
    return min(int(share * _BARS), _BARS - 1)


def _interval(value: Value, k: int) -> str:
    ends = (value.low * (value.high / value.low) ** (edge / _BARS) for edge in (k, k + 1))
    low, high = (f"{end:.2g}" if end < 100 else f"{end:.0f}" for end in ends)
    return f"{low} to {high} {value.measure.unit}".rstrip()
