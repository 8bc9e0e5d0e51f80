"""The state of a class as data: its step, its vote and its members. Each method returns the next state."""

from __future__ import annotations

import math
from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Literal

from app.link.exercise import Answer, Lecture, LessonPlace
from lessons.teaching.lesson import Step
from lessons.teaching.poll import Poll
from lessons.teaching.prediction import Choice, Sketch, Value
from robots import InputError

NAME = 60
"""Largest length of a name, characters."""
Kind = Literal["robot", "phone"]


@dataclass(frozen=True)
class Member:
    """The data about a person that the teacher sees.

    Attributes:
        number: 1 for the first person in the class.
        kind: whether they have a robot of their own or only a phone.
        since: the time of their last action in the lesson, s on the clock of the server.
        name: the name that they typed, or their account.
        account: the account with which they signed in at the proxy; "" if there is none.
        here: whether their page is open.
        at: the step on their page.
        done: for every step whose run ended, the number of claims that held and the number of all claims.
        trace: their step and run at the last check; a difference is an action.
    """

    number: int
    kind: Kind
    since: float
    name: str = ""
    account: str = ""
    here: bool = True
    at: LessonPlace | None = None
    done: Mapping[LessonPlace, tuple[int, int]] = field(default_factory=dict)
    trace: Hashable = None

    def named(self, name: str) -> Member:
        """Returns the member with another name; characters that cannot be printed become blanks."""
        plain = "".join(sign if sign.isprintable() else " " for sign in name[:NAME])
        return replace(self, name=" ".join(plain.split()))

    def seen(self, at: LessonPlace | None, lecture: Lecture | None, now: float) -> Member:
        """Returns the member after a check of their page. at: the step that is loaded; lecture: its run."""
        run = None if lecture is None else (lecture.phase, lecture.attempt, lecture.answer)
        trace = (at, run)
        if trace == self.trace:
            return self
        done = self.done
        if lecture is not None and lecture.phase == "done":
            met = sum(each is True for each in lecture.holds), len(lecture.holds)
            done = {**done, lecture.exercise: met}
        return replace(self, at=at, trace=trace, since=now, done=done)

    @property
    def claims(self) -> tuple[int, int]:
        """The number of claims that held and the number of all claims, over all steps whose run ended."""
        return sum(met for met, _ in self.done.values()), sum(count for _, count in self.done.values())


MEMBERS = 2000
"""Largest number of people in a class."""
Stage = Literal["waiting", "open", "closed", "running", "decided"]
"""Before a vote; during the vote; after the vote; while the robot runs; after the run."""


@dataclass(frozen=True)
class Held:
    """A past vote. truth: the value that the run measured; NaN if the step did not run."""

    place: LessonPlace
    poll: Poll
    truth: float


@dataclass(frozen=True)
class Gathering:
    """A class.

    Attributes:
        named: whether people are asked for their names.
        place: the step that the teacher chose.
        poll: the vote on this step, if it was opened.
        truth: the value that the step's run measured; NaN before the run.
        running: whether the step runs.
        stays: whether learners stay at this step until the teacher chooses another one.
        everywhere: whether the step runs on all pages; otherwise it runs on the teacher's robot only.
        members: the members by identity; only a member's page and the server know this identity.
        past: earlier votes.
    """

    named: bool = True
    place: LessonPlace | None = None
    poll: Poll | None = None
    truth: float = math.nan
    running: bool = False
    stays: bool = False
    everywhere: bool = True
    members: Mapping[str, Member] = field(default_factory=dict)
    past: tuple[Held, ...] = ()

    @property
    def stage(self) -> Stage:
        if self.running:
            return "running"
        if not math.isnan(self.truth):
            return "decided"
        if self.poll is None:
            return "waiting"
        return "open" if self.poll.is_open else "closed"

    @property
    def votes(self) -> tuple[Held, ...]:
        """All votes with at least one voter, the present vote last."""
        if self.place is None or self.poll is None or not any(self.poll.rounds):
            return self.past
        return (*self.past, Held(self.place, self.poll, self.truth))

    # ---------------------------------------------------------------- the teacher

    def going_to(self, place: LessonPlace) -> Gathering:
        """Returns the class at another step, or at the beginning of the same step."""
        return replace(self, place=place, poll=None, truth=math.nan, running=False, past=self.votes)

    def opened(self) -> Gathering:
        """Returns the class with an open vote, the first or the second one. Raises InputError if there is
        nothing to vote on, or if the run has already shown the answer."""
        asked = question_of(self.place)
        if self.stage in ("running", "decided"):
            raise InputError("this step has run: choose it again for a new vote, or choose another step")
        return replace(self, poll=Poll(asked) if self.poll is None else self.poll.again())

    def closed(self) -> Gathering:
        """Returns the class after its vote. Raises InputError if no vote is open."""
        if self.poll is None or not self.poll.is_open:
            raise InputError("no vote is open")
        return replace(self, poll=self.poll.closed())

    def started(self) -> Gathering:
        """Returns the class while its step runs; the vote is then closed. Raises InputError if no step is
        chosen."""
        if self.place is None:
            raise InputError("choose a step first")
        poll = None if self.poll is None else self.poll.closed()
        return replace(self, running=True, truth=math.nan, poll=poll)

    def measured(self, truth: float) -> Gathering:
        """Returns the class after the run. truth: the measured number; NaN if the step measures none."""
        return replace(self, running=False, truth=truth)

    def guess(self) -> Answer | None:
        """Returns the prediction for a learner who made none: the most frequent answer of the class. None if
        the step asks for no prediction."""
        prediction = None if self.place is None else _prediction(self.place)
        match prediction:
            case None:
                return None
            case Sketch() as wanted:
                return ((0.0, wanted.low), (wanted.until, wanted.low))
            case Choice():
                return int((self.poll or Poll(prediction)).favourite())
            case Value():
                return float((self.poll or Poll(prediction)).favourite())

    # ---------------------------------------------------------------- the members

    def entered(self, who: str, kind: Kind, now: float, account: str = "") -> Gathering:
        """Returns the class with one more member, or with a member who came back. account: the account with
        which the member signed in; it becomes the member's name if the class uses names. If the
        class is full, a person who left without a vote or a run is removed. Raises InputError if there is no
        such person."""
        known, account = self.members.get(who), account if self.named else ""
        if known is not None and (known.here, known.account) == (True, account):
            return self
        if known is not None:
            known = known if known.account == account else replace(known, account=account).named(account)
            return self._with(who, replace(known, here=True))
        members = self.members
        if len(members) >= MEMBERS:
            voted = {voter for held in self.votes for votes in held.poll.rounds for voter in votes}
            gone = next(
                (one for one, each in members.items() if not (each.here or each.done or one in voted)), None
            )
            if gone is None:
                raise InputError(f"this class has {MEMBERS} people, and takes no more")
            members = {one: each for one, each in members.items() if one != gone}
        number = 1 + max((each.number for each in members.values()), default=0)
        member = Member(number, kind, now, account=account).named(account)
        return replace(self, members={**members, who: member})

    def left(self, who: str) -> Gathering:
        """Returns the class after a member's page was closed. Votes and progress are kept."""
        known = self.members.get(who)
        return self if known is None or not known.here else self._with(who, replace(known, here=False))

    def succeeded(self, who: str, before: Sequence[str], account: str = "") -> Gathering:
        """Returns the class after a learner who had left came back under another identity, `who`. The learner
        is recognised by the browser (`before`: its earlier identities) or by the account."""
        members, account = self.members, account if self.named else ""
        theirs = [one for one, each in members.items() if account and each.account == account]
        known = [*theirs, *(one for one in before if one in members and members[one].account == account)]
        old = next((one for one in reversed(known) if not members[one].here), who)
        if old == who or who in members:
            return self
        members = {who if one == old else one: each for one, each in self.members.items()}
        past = tuple(replace(held, poll=_handed_on(held.poll, old, who)) for held in self.past)
        poll = None if self.poll is None else _handed_on(self.poll, old, who)
        return replace(self, members=members, past=past, poll=poll)

    def called(self, who: str, name: str) -> Gathering:
        """Returns the class after a member typed a name. The name is ignored if the class uses no names, or
        if the member signed in with an account."""
        known = self.members.get(who)
        if known is None or known.account or not self.named:
            return self
        return self._with(who, known.named(name))

    def voted(self, who: str, answer: object, now: float) -> Gathering:
        """Returns the class after a vote. Raises InputError if it cannot be counted."""
        if self.poll is None:
            raise InputError("no vote is open: wait for your teacher")
        poll, known = self.poll.with_vote(who, answer), self.members.get(who)
        if poll is self.poll or known is None:
            return self
        return replace(self._with(who, replace(known, since=now)), poll=poll)

    def seen(self, who: str, at: LessonPlace | None, lecture: Lecture | None, now: float) -> Gathering:
        """Returns the class after a check of a learner's page. While a vote is open, the learner's prediction
        counts as a vote."""
        known = self.members.get(who)
        if known is None:
            return self
        member = known.seen(at, lecture, now)
        after = self if member is known else self._with(who, member)
        answer = None if lecture is None or lecture.exercise != self.place else lecture.answer
        if answer is None or self.poll is None or not self.poll.is_open:
            return after
        try:
            return after.voted(who, answer, now)
        except InputError:
            return after  # there are too many voters; the learner's page does not show this

    def _with(self, who: str, member: Member) -> Gathering:
        return replace(self, members={**self.members, who: member})


def question_of(place: LessonPlace | None) -> Choice | Value:
    """Returns the question of a step on which the class can vote. Raises InputError if there is none."""
    if place is None:
        raise InputError("choose a step first")
    found = _prediction(place)
    if isinstance(found, Sketch):
        raise InputError("this step asks for a curve, which is not counted: let everybody draw, then run")
    if found is None:
        raise InputError("this step asks no question before its run: run it, or choose another step")
    return found


def _handed_on(poll: Poll, old: str, new: str) -> Poll:
    rounds = tuple({new if one == old else one: vote for one, vote in votes.items()} for votes in poll.rounds)
    return replace(poll, rounds=rounds)


def _prediction(place: LessonPlace) -> Choice | Value | Sketch | None:
    part = place.part
    return part.prediction if isinstance(part, Step) else None
