"""The messages between the servers of one class. The server with the teacher's page sends the state of the
class; the other servers send the states of their learners. The data have bounds. No part of them is run as
code or shown as HTML."""

from __future__ import annotations

import math
import re
from collections import Counter
from collections.abc import Mapping, Sequence
from typing import Annotated

import msgspec
from msgspec import Meta

from app.classes.gathering import Gathering, question_of
from app.classes.member import Member
from app.classes.views import View
from app.classes.words import BOUND, LONGEST_NAME, Number, Short
from app.link.exercise import LessonPlace
from lessons.replay.state import MAX_CODE
from lessons.teaching.poll import ROUNDS, VOTERS, Poll, valid
from robots import InputError

LONGEST = 200_000
"""Largest message between two servers, B."""
BEFORE = 8
"""Largest number of earlier identities of a browser in a message."""
PORTION = 50_000
"""Size, B, above which a message is sent; further learners follow in the next message. The data of one
learner are smaller than LONGEST − PORTION."""

_SECRET = r"^[A-Za-z0-9_-]{16,64}\Z"
Secret = Annotated[str, Meta(pattern=_SECRET)]
Count = Annotated[int, Meta(ge=0, le=100_000)]
Place = tuple[Short, Annotated[int, Meta(ge=0, le=1000)]]
Ran = tuple[Short, Annotated[int, Meta(ge=0, le=1000)], Count, Count]
"""A run that ended: lesson, step, number of claims that held, and number of all claims."""
Answered = int | Number
Votes = Annotated[list[tuple[Answered, Count]], Meta(max_length=VOTERS)]


class Join(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="join"):
    """The first message of another server. server: identifies this server when it connects again."""

    server: Secret


class LearnerNow(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A learner on another server.

    Attributes:
        who: the learner's identity.
        before: the earlier identities of the learner's browser.
        name: the name that the learner typed, None if there is none; account: the account with which the
            learner signed in.
        here: whether the learner's page is open.
        at: the step on the learner's page.
        done: every step whose run ended.
        answer: the learner's prediction at the class's step.
        visit: the class's number of visits to a step when this report was made, see `Gathering`.
        quiet: time since the learner's last action, s.
    """

    who: Secret
    before: Annotated[tuple[Secret, ...], Meta(max_length=BEFORE)] = ()
    name: Short | None = None
    account: Short = ""
    here: bool = True
    at: Place | None = None
    done: Annotated[tuple[Ran, ...], Meta(max_length=300)] = ()
    answer: Answered | None = None
    visit: Count = 0
    quiet: Annotated[float, Meta(ge=0.0, le=1e9)] = 0.0


class LearnersNow(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="learners"):
    """The learners whose data have changed."""

    learners: Annotated[list[LearnerNow], Meta(max_length=500)]


class StateTold(msgspec.Struct, forbid_unknown_fields=True, tag_field="do", tag="state"):
    """The code of a learner's state; "" if there is none."""

    who: Secret
    code: Annotated[str, Meta(max_length=MAX_CODE)]


class ClassNow(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="class"):
    """The state of the class, see `app.classes.gathering.Gathering`.

    Attributes:
        rounds: the votes of each round: each answer with its number of voters. The round that is still open
            is empty.
        is_open: whether a vote is open; None if there is no vote.
        truth: None if nothing was measured.
    """

    named: bool
    place: Place | None
    visits: Count
    runs: Count
    stays: bool
    everywhere: bool
    running: bool
    is_open: bool | None
    rounds: Annotated[list[Votes], Meta(max_length=ROUNDS)]
    truth: Number | None


class AskState(msgspec.Struct, frozen=True, forbid_unknown_fields=True, tag_field="do", tag="ask"):
    """A request for a learner's state, which the teacher wants to open."""

    who: Secret


OfServer = Join | LearnersNow | StateTold
OfClass = ClassNow | AskState

of_server = msgspec.json.Decoder(OfServer)
of_class = msgspec.json.Decoder(OfClass)


def is_secret(text: str) -> bool:
    """Returns whether a text can be the identity of a learner. It comes from a browser, which can store any
    text."""
    return re.match(_SECRET, text) is not None


def read_place(told: Place, course: Sequence[View]) -> LessonPlace:
    """Returns a step of one of the lessons of a class. Raises InputError for any other step. No file is
    read."""
    lesson, place = told
    if lesson not in (each["name"] for each in course):
        raise InputError("there is no such lesson in this class")
    return LessonPlace.at(lesson, place + 1)


def known_place(told: Place | None, course: Sequence[View]) -> LessonPlace | None:
    """As `read_place`, but returns None for a step that the class does not have."""
    try:
        return None if told is None else read_place(told, course)
    except InputError:
        return None


def read_done(told: Sequence[Ran], course: Sequence[View]) -> dict[LessonPlace, tuple[int, int]]:
    """Returns, for each step that the class has, the number of claims that held and the number of all
    claims."""
    found = ((known_place((lesson, k), course), met, claims) for lesson, k, met, claims in told)
    return {place: (min(met, claims), claims) for place, met, claims in found if place is not None}


def can_be_told(place: LessonPlace) -> bool:
    """Returns whether a message can name a step. The path of a teacher's own lesson may be too long."""
    return len(place.lesson) <= LONGEST_NAME and place.lesson.isprintable()


def class_now(state: Gathering) -> ClassNow:
    """Returns the state of a class of learners, without the list of its learners."""
    place, poll = state.place, state.poll
    rounds = [] if poll is None else [sorted(Counter(votes.values()).items()) for votes in poll.rounds]
    if poll is not None and poll.is_open:
        rounds[-1] = []
    return ClassNow(
        state.named,
        None if place is None else (place.lesson, place.place),
        state.visits,
        state.runs,
        state.stays,
        state.everywhere,
        state.running,
        None if poll is None else poll.is_open,
        rounds,
        state.truth if abs(state.truth) <= BOUND else None,
    )


def read_class(now: ClassNow, course: Sequence[View], members: Mapping[str, Member]) -> Gathering:
    """Returns the state of a class, with the members of this server. Raises InputError for a step or an
    answer that the course does not have."""
    place = None if now.place is None else read_place(now.place, course)
    return Gathering(
        now.named,
        place,
        None if now.is_open is None else _poll(now.rounds, now.is_open, place),
        math.nan if now.truth is None else now.truth,
        now.running,
        now.stays,
        now.everywhere,
        members,
        visits=now.visits,
        runs=now.runs,
    )


def _poll(rounds: Sequence[Votes], is_open: bool, place: LessonPlace | None) -> Poll:
    asked = question_of(place)
    if not rounds or any(sum(count for _, count in votes) > VOTERS for votes in rounds):
        raise InputError("the votes of this class cannot be counted")
    voters = [[valid(asked, answer) for answer, count in votes for _ in range(count)] for votes in rounds]
    return Poll(asked, tuple({f"voter {k}": vote for k, vote in enumerate(each)} for each in voters), is_open)
