"""The data that the pages of a class show, for JSON."""

from __future__ import annotations

import math
from typing import Any

from app.classes.gathering import Gathering, Held, question_of
from app.classes.table import LETTERS, answer
from app.html.markdown import rendered_line
from app.html.text import esc, figure
from app.link.exercise import LessonPlace, parts_of
from lessons.course import COURSE
from lessons.teaching.lesson import Challenge
from lessons.teaching.poll import histogram
from lessons.teaching.prediction import Choice, Sketch, Value
from robots import InputError

View = dict[str, Any]


def for_all(gathering: Gathering) -> View:
    """Returns the data for everybody: the step, the question, and the bars of each closed vote."""
    place = gathering.place
    return {
        "stage": gathering.stage,
        "title": "" if place is None else title(place),
        "asked": _asked(place),
        "round": 0 if gathering.poll is None else len(gathering.poll.rounds),
        "voted": 0 if gathering.poll is None else len(gathering.poll.latest),
        "rounds": _bars(gathering),
        "result": _result(gathering),
        "named": gathering.named,
    }


def for_teacher(gathering: Gathering, now: float) -> View:
    """Returns the further data for the teacher: a row per learner, the number of phones, and the settings of
    the class."""
    members = gathering.members.values()
    return {
        "rows": [_row(who, gathering, now) for who, one in gathering.members.items() if one.kind == "robot"],
        "phones": sum(each.here for each in members if each.kind == "phone"),
        "stays": gathering.stays,
        "everywhere": gathering.everywhere,
        "place": None if gathering.place is None else [gathering.place.lesson, gathering.place.place],
    }


def course(own: str | None = None) -> list[View]:
    """Returns the lessons with their steps, for the teacher's list. `asks`: the kind of prediction for which
    a step asks, "" if none. own: the teacher's own lesson, which comes first."""
    names = COURSE if own is None or own in COURSE else (own, *COURSE)
    return [
        {
            "name": name,
            "title": f"{number} · {lesson.card.title}",
            "steps": [_step(LessonPlace(name, k)) for k in range(len(parts_of(lesson)))],
        }
        for number, (name, lesson) in enumerate(
            ((each, LessonPlace(each).whole) for each in names), start=1 - (len(names) - len(COURSE))
        )
    ]


def title(place: LessonPlace) -> str:
    """Returns the titles of the lesson and the step."""
    return f"{place.whole.card.title} · {_step(place)['title']}"


def _step(place: LessonPlace) -> View:
    part = place.part
    if isinstance(part, Challenge):
        return {"title": "challenge", "asks": ""}
    kinds = {Choice: "choice", Value: "number", Sketch: "curve"}
    return {"title": f"{place.place + 1} {part.title}", "asks": kinds.get(type(part.prediction), "")}


def _asked(place: LessonPlace | None) -> View | None:
    """Returns the question as HTML, with options or with a scale; None if there is no question to vote on."""
    try:
        asked = question_of(place)
    except InputError:
        return None
    match asked:
        case Choice():
            options = [rendered_line(each.text) for each in asked.options]
            return {"question": rendered_line(asked.question), "options": options}
        case Value() as value:
            scale = {"low": value.low, "high": value.high, "unit": value.measure.unit}
            return {"question": rendered_line(asked.question), "scale": scale}


def _bars(gathering: Gathering) -> list[list[View]]:
    """Returns the bars of each round that is over. While people vote, nobody sees the answers of others."""
    poll = gathering.poll
    if poll is None:
        return []
    over = range(len(poll.rounds) - poll.is_open)
    choice = isinstance(poll.question, Choice)
    return [
        [
            {
                "letter": LETTERS[k] if choice else "",
                "label": rendered_line(bar.label) if choice else esc(bar.label),
                "count": bar.count,
                "right": bar.right,
            }
            for k, bar in enumerate(histogram(poll, number, gathering.truth))
        ]
        for number in over
    ]


def _result(gathering: Gathering) -> str:
    """Returns sentences with the measured value and the number of people who were right."""
    poll, truth = gathering.poll, gathering.truth
    if poll is None or math.isnan(truth):
        return ""
    measured = f"The run gave {figure(truth, poll.question.measure.unit)}."
    counts = [
        f"{right} of {len(votes)}"
        for number, votes in enumerate(poll.rounds)
        if votes and (right := poll.right(truth, number)) is not None
    ]
    if not counts:
        return measured
    first = f" In the first vote: {counts[0]}." if len(counts) > 1 else ""
    return f"{measured} {counts[-1]} {'was' if counts[-1].startswith('1 ') else 'were'} right.{first}"


def _row(who: str, gathering: Gathering, now: float) -> View:
    member = gathering.members[who]
    met, claims = member.claims
    last = next((held for held in reversed(gathering.votes) if _vote(held, who) is not None), None)
    return {
        "number": member.number,
        "name": member.name if gathering.named else "",
        "here": member.here,
        "at": "" if member.at is None else title(member.at),
        "with": member.at is not None and member.at == gathering.place,
        "done": len(member.done),
        "met": met,
        "claims": claims,
        "vote": "" if last is None else answer(last, _vote(last, who)),
        "quiet": int(now - member.since),
    }


def _vote(held: Held, who: str) -> float | None:
    return next((votes[who] for votes in reversed(held.poll.rounds) if who in votes), None)
