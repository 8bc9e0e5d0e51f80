"""A poll is data: votes, rounds, histograms, and the answers that were right."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from lessons.course import COURSE, load_lesson
from lessons.teaching.measure import Measure
from lessons.teaching.poll import ROUNDS, VOTERS, Poll, histogram
from lessons.teaching.prediction import Choice, Value
from robots import InputError

ASKED = [
    step.prediction
    for name in COURSE
    for step in load_lesson(name).steps
    if isinstance(step.prediction, (Choice, Value))
]
CHOICE = next(each for each in ASKED if isinstance(each, Choice))
VALUE = next(each for each in ASKED if isinstance(each, Value))


def test_a_later_vote_replaces_the_earlier_one() -> None:
    poll = Poll(CHOICE).with_vote("zoe", 0).with_vote("max", 1).with_vote("zoe", 1)
    assert dict(poll.latest) == {"zoe": 1, "max": 1}
    assert [bar.count for bar in histogram(poll)][:2] == [0, 2]
    assert all(bar.right is None for bar in histogram(poll))


def test_a_closed_poll_counts_nothing_more_until_its_second_round() -> None:
    poll = Poll(CHOICE).with_vote("zoe", 0).closed()
    with pytest.raises(InputError, match="closed"):
        poll.with_vote("max", 0)
    assert poll.closed() == poll
    again = poll.again().with_vote("zoe", 1)
    assert [dict(each) for each in again.rounds] == [{"zoe": 0}, {"zoe": 1}]
    with pytest.raises(InputError, match="open"):
        again.again()
    assert len(again.rounds) == ROUNDS
    with pytest.raises(InputError, match="second vote"):
        again.closed().again()


NONSENSE: list[object] = [None, "0", -1, 10**30, 1e30, True, math.nan, math.inf, [0], {"a": 1}, "x" * 10**6]


@pytest.mark.parametrize("asked", [CHOICE, VALUE])
@pytest.mark.parametrize("answer", NONSENSE, ids=lambda each: repr(each)[:20])
def test_nonsense_is_refused_with_one_short_sentence(asked: Choice | Value, answer: object) -> None:
    poll = Poll(asked)
    with pytest.raises(InputError) as refused:
        poll.with_vote("zoe", answer)
    assert "\n" not in str(refused.value) and len(str(refused.value)) < 120
    assert not poll.latest


def test_a_poll_holds_a_bounded_number_of_voters() -> None:
    poll = Poll(CHOICE, ({str(k): 0 for k in range(VOTERS)},))
    with pytest.raises(InputError, match="no more"):
        poll.with_vote("one more", 0)
    assert poll.with_vote("7", 1).latest["7"] == 1


@given(st.lists(st.floats(VALUE.low, VALUE.high), max_size=40))
def test_every_number_on_the_scale_is_in_one_bar(numbers: list[float]) -> None:
    poll = Poll(VALUE)
    for k, number in enumerate(numbers):
        poll = poll.with_vote(str(k), number)
    assert sum(bar.count for bar in histogram(poll)) == len(numbers)


@pytest.mark.parametrize("asked", ASKED, ids=lambda each: each.question[:30])
def test_who_was_right_agrees_with_the_bars(asked: Choice | Value) -> None:
    """In every question of the course, one answer is right for a measured number, and its bar is marked."""
    match asked:
        case Choice():
            option = asked.options[0]
            low, high = max(option.low, -1e9), min(option.high, 1e9)
            truth, right, wrong = (low + high) / 2, 0, 1
            if option.low == -math.inf and option.high == math.inf:
                pytest.skip("its only option")
        case Value():
            truth, right = math.sqrt(asked.low * asked.high), math.sqrt(asked.low * asked.high)
            wrong = asked.low if asked.high / asked.low > asked.factor**2 * 1.01 else asked.high
    poll = Poll(asked).with_vote("zoe", right).with_vote("max", wrong).with_vote("kim", right).closed()
    assert poll.right(truth) == 2 and poll.right(math.nan) is None
    bars = histogram(poll, truth=truth)
    assert sum(bool(bar.right) for bar in bars) == 1
    assert poll.favourite() == right


def test_a_value_of_two_rounds_counts_each_for_itself() -> None:
    asked = Value("How much?", Measure(VALUE.measure.signal), 1.0, 100.0)
    poll = (
        Poll(asked)
        .with_vote("zoe", 1.0)
        .with_vote("max", 1.0)
        .closed()
        .again()
        .with_vote("zoe", 10.0)
        .closed()
    )
    assert (poll.right(10.0, 0), poll.right(10.0, 1)) == (0, 1)
    assert Poll(asked).favourite() == pytest.approx(10.0)
    assert histogram(poll, 0)[0].count == 2
