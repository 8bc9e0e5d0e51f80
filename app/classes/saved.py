"""The state of a class as data for a file, with which a server that was started again continues the class."""

from __future__ import annotations

import math
import time
from collections.abc import Iterator, Mapping
from typing import Annotated

import msgspec
from msgspec import Meta

from app.classes.gathering import MEMBERS, NAME, Gathering, Held, Kind, Member, question_of
from app.link.exercise import LessonPlace
from lessons.teaching.poll import ROUNDS, Poll, valid
from robots import InputError

Place = tuple[str, Annotated[int, Meta(ge=0, le=1000)]]
"""Lesson and step; 0 for the first step."""
Count = Annotated[int, Meta(ge=0, le=100_000)]


class SavedMember(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A member, see `app.classes.gathering.Member`. since: on the clock of the calendar, s."""

    who: str
    number: Count
    kind: Kind
    since: float
    name: Annotated[str, Meta(max_length=NAME)]
    account: str
    at: Place | None
    done: list[tuple[Place, Count, Count]]


class SavedVote(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """The votes on a step. truth: the measured value, None if nothing was measured."""

    place: Place
    rounds: Annotated[list[dict[str, int | float]], Meta(min_length=1, max_length=ROUNDS)]
    is_open: bool
    truth: float | None


class SavedGathering(msgspec.Struct, frozen=True, forbid_unknown_fields=True):
    """A class, see `app.classes.gathering.Gathering`."""

    place: Place | None
    poll: SavedVote | None
    truth: float | None
    stays: bool
    everywhere: bool
    members: Annotated[list[SavedMember], Meta(max_length=MEMBERS)]
    past: list[SavedVote]


def saved(state: Gathering) -> SavedGathering:
    poll = None if state.poll is None or state.place is None else Held(state.place, state.poll, state.truth)
    return SavedGathering(
        None if state.place is None else _told(state.place),
        None if poll is None else _vote(poll),
        _number(state.truth),
        state.stays,
        state.everywhere,
        [_member(who, each) for who, each in state.members.items()],
        [_vote(each) for each in state.past],
    )


def restored(kept: SavedGathering, lessons: frozenset[str]) -> Gathering:
    """Returns the class that was saved. Nobody's page is open yet, and a run that was not over has to be run
    again. lessons: the lessons of this class; steps that they do not have, and their votes, are left out."""
    place = _place(kept.place, lessons)
    poll = None if place is None or kept.poll is None else _poll(kept.poll, place)
    past = ((each, _place(each.place, lessons)) for each in kept.past)
    held = ((at, _poll(each, at), _truth(each.truth)) for each, at in past if at is not None)
    return Gathering(
        place=place,
        poll=poll,
        truth=math.nan if place is None else _truth(kept.truth),
        stays=kept.stays,
        everywhere=kept.everywhere,
        members=dict(_members(kept, lessons)),
        past=tuple(Held(at, votes, truth) for at, votes, truth in held if votes is not None),
    )


def _members(kept: SavedGathering, lessons: frozenset[str]) -> Iterator[tuple[str, Member]]:
    now, today = time.monotonic(), time.time()
    for each in kept.members:
        done = {_place(at, lessons): (met, claims) for at, met, claims in each.done}
        yield (
            each.who,
            Member(
                each.number,
                each.kind,
                now - max(0.0, today - each.since),
                account=each.account,
                here=False,
                at=_place(each.at, lessons),
                done={at: count for at, count in done.items() if at is not None},
            ).named(each.name),
        )


def _member(who: str, member: Member) -> SavedMember:
    return SavedMember(
        who,
        member.number,
        member.kind,
        time.time() - (time.monotonic() - member.since),
        member.name,
        member.account,
        None if member.at is None else _told(member.at),
        [(_told(at), met, claims) for at, (met, claims) in member.done.items()],
    )


def _vote(held: Held) -> SavedVote:
    rounds = [dict(votes) for votes in held.poll.rounds]
    return SavedVote(_told(held.place), rounds, held.poll.is_open, _number(held.truth))


def _poll(kept: SavedVote, place: LessonPlace) -> Poll | None:
    """Returns the votes that were saved; None if the step has another question now."""
    try:
        asked = question_of(place)
        rounds: tuple[Mapping[str, float], ...] = tuple(
            {who: valid(asked, answer) for who, answer in votes.items()} for votes in kept.rounds
        )
    except InputError:
        return None
    return Poll(asked, rounds, kept.is_open)


def _told(place: LessonPlace) -> Place:
    return place.lesson, place.place


def _place(kept: Place | None, lessons: frozenset[str]) -> LessonPlace | None:
    try:
        return None if kept is None or kept[0] not in lessons else LessonPlace.at(kept[0], kept[1] + 1)
    except InputError:
        return None


def _number(truth: float) -> float | None:
    return truth if math.isfinite(truth) else None


def _truth(kept: float | None) -> float:
    return math.nan if kept is None else kept
