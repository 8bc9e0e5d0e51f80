"""One person in a class: a learner with a robot of their own, or a phone that votes."""

from __future__ import annotations

from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import Literal

from app.link.exercise import Lecture, LessonPlace

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
