"""One person in a class: a learner with a robot of their own, or a phone that votes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from app.link.exercise import Lecture, LessonPlace

NAME = 60
"""Longest name, characters."""
Kind = Literal["robot", "phone"]


@dataclass(frozen=True)
class Member:
    """What the teacher sees of a person.

    Attributes:
        number: 1 for the first who came.
        kind: whether they have a robot of their own or only a phone.
        since: when they last did anything in the lesson, s on the clock of the server.
        name: what they typed, or their account.
        account: with which they signed in at the proxy; "" if there is none.
        here: whether their page is open.
        at: the step on their page.
        done: claims that held, and claims in all, of every step whose run ended.
        trace: what they did last, to notice when it changes.
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
        """The member under a name; what cannot be printed becomes a blank."""
        plain = "".join(sign if sign.isprintable() else " " for sign in name[:NAME])
        return replace(self, name=" ".join(plain.split()))

    def seen(self, at: LessonPlace | None, lecture: Lecture | None, now: float) -> Member:
        """The member after a look at their page. at: the step that is loaded; lecture: its run."""
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
        """Claims that held, and claims in all, over all steps whose run ended."""
        return sum(met for met, _ in self.done.values()), sum(count for _, count in self.done.values())
