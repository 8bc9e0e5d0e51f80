"""A server in a class whose teacher uses another server. This server brings its own learners to the class's
steps and reports their state to the teacher's server."""

from __future__ import annotations

import secrets
import time
from collections.abc import Iterator, Sequence
from dataclasses import replace

import msgspec

from app.classes.relayed import (
    BEFORE,
    PORTION,
    ClassNow,
    LearnerNow,
    LearnersNow,
    can_be_told,
    is_secret,
    read_class,
)
from app.classes.room import Learners, Room
from app.classes.views import course
from app.client.state_code import code_of
from robots import InputError


class Branch(Room):
    """The learners of one server in a class whose teacher's page is on another server."""

    def __init__(self, sessions: Learners, own: str | None = None) -> None:
        """own: the lesson with which this server was started."""
        super().__init__(sessions, named=False)  # nobody is asked for a name before the class requests names
        self.server = secrets.token_urlsafe(16)
        """Identifies this server when it connects again."""
        self.course = course(own)
        """The lessons that this server has."""
        self._linked = False
        self._before: dict[str, tuple[str, ...]] = {}
        self._names: dict[str, str] = {}  # the names that were typed on this server
        self._told: dict[str, tuple[LearnerNow, float]] = {}  # the last reports to the class

    @property
    def guide(self) -> None:
        return None

    @property
    def _cut_off(self) -> bool:
        return not self._linked

    # ---------------------------------------------------------------- the link

    def linked(self) -> None:
        """Called when the class's server has accepted this server. When the state of the class arrives, this
        server reports all its learners again."""
        with self._lock:
            self._told, self._linked = {}, False

    def cut_off(self) -> None:
        """Called when the connection was lost. Learners may then continue without the class."""
        with self._lock:
            self._linked = False
            self._state = replace(self._state, stays=False)
            self._keep()

    def hear(self, now: ClassNow) -> None:
        """Receives the state of the class, and brings the learners to the class's step. Raises InputError for
        an impossible state."""
        if now.place is not None and now.place[0] not in (each["name"] for each in self.course):
            nowhere = {"place": None, "is_open": None, "rounds": [], "running": False, "truth": None}
            now = msgspec.structs.replace(now, **nowhere)  # the teacher's own lesson
        with self._lock:
            before = self._state
            self._state = read_class(now, self.course, before.members)
            self._linked = True
            elsewhere = (now.visits, self._state.place) != (before.visits, before.place)
            if elsewhere:
                self._lead()
            else:
                self._keep()
        if now.running if elsewhere else now.runs > before.runs:
            self._let_run()

    def news(self) -> Iterator[bytes]:
        """Messages about the learners whose state has changed since the last report."""
        with self._lock:
            if not self._linked:
                return  # a vote may belong to a step that is not the class's
            state, now = self._state, time.monotonic()
            fresh = {who: (self._of(who), each.since) for who, each in state.members.items()}
            telling = {who: (_lasting(told), since) for who, (told, since) in fresh.items()}
            changed = [who for who, told in telling.items() if self._told.get(who) != told]
            self._told = telling
        portion: list[LearnerNow] = []
        size = 0
        for who in changed:
            told, since = fresh[who]
            portion.append(msgspec.structs.replace(told, quiet=max(0.0, now - since)))
            size += len(msgspec.json.encode(told))
            if size > PORTION:
                yield msgspec.json.encode(LearnersNow(portion))
                portion, size = [], 0
        if portion:
            yield msgspec.json.encode(LearnersNow(portion))

    def _of(self, who: str) -> LearnerNow:
        state = self._state
        member, poll = state.members[who], state.poll
        at = None if member.at is None or not can_be_told(member.at) else (member.at.lesson, member.at.place)
        done = ((place, *met) for place, met in member.done.items() if can_be_told(place))
        return LearnerNow(
            who,
            self._before.get(who, ()),
            self._names.get(who),
            member.account,
            member.here,
            at,
            tuple((place.lesson, place.place, met, claims) for place, met, claims in done),
            None if poll is None or not poll.is_open else poll.latest.get(who),
            state.visits,
        )

    def code_of(self, who: str) -> str:
        """Returns the code of a learner's state; "" if there is none."""
        told = self._latest(who)
        try:
            return "" if told is None else code_of(told)
        except InputError:
            return ""  # e.g. an uploaded robot

    # ---------------------------------------------------------------- the learners

    def recognise(self, who: str, before: Sequence[str], account: str = "") -> None:
        with self._lock:
            known = self._state.members
            super().recognise(who, before, account)
            for one in (known.keys() - self._state.members.keys()) & self._names.keys():
                self._names[who] = self._names.pop(one)
            self._before[who] = tuple(each for each in before if each != who and is_secret(each))[-BEFORE:]
            there = {who, *self._state.members, *(each.token for each in self._learners())}
            for kept in (self._names, self._before):
                for one in kept.keys() - there:
                    del kept[one]

    def call(self, who: str, name: str) -> None:
        super().call(who, name)
        with self._lock:
            if who in self._state.members:
                self._names[who] = self._state.members[who].name


def _lasting(told: LearnerNow) -> LearnerNow:
    """Returns the part of a learner's data that is reported whenever it changes. If the learner has left,
    visit and answer are not part of it."""
    return told if told.here else msgspec.structs.replace(told, visit=0, answer=None)
