"""The data of a class for its pages, as JSON, and for a spreadsheet, as a table."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator
from typing import Any

from app.classes.gathering import Gathering, Held, Member, question_of
from app.html.markdown import rendered_line
from app.html.text import esc, figure
from app.link.exercise import LessonPlace, parts_of
from lessons.course import COURSE
from lessons.exercises.cells import cell
from lessons.teaching.lesson import Challenge
from lessons.teaching.poll import histogram
from lessons.teaching.prediction import Choice, Sketch, Value
from robots import InputError

LETTERS = "ABCDEFG"
COLUMNS = (
    *("number", "name", "kind", "lesson", "step"),
    *("first vote", "second vote", "right", "measured", "run", "claims met", "claims"),
)


def table(gathering: Gathering) -> str:
    """Returns the table: one line for each person and each step that the person ran or voted on. A person
    without such a step has one line without a step. A class without names has no column for names."""
    columns = COLUMNS if gathering.named else tuple(each for each in COLUMNS if each != "name")
    text = io.StringIO()
    writer = csv.DictWriter(text, columns, extrasaction="ignore", lineterminator="\n")
    writer.writeheader()
    for who, member in gathering.members.items():
        writer.writerows(_lines(who, member, gathering))
    return text.getvalue()


def _lines(who: str, member: Member, gathering: Gathering) -> Iterator[dict[str, object]]:
    own = {"number": member.number, "name": cell(member.name), "kind": member.kind}
    voted = {held.place: held for held in gathering.votes if any(who in each for each in held.poll.rounds)}
    places = tuple(dict.fromkeys((*voted, *member.done)))
    for place in places:
        met = member.done.get(place)
        yield {
            **own,
            "lesson": cell(place.lesson),
            "step": place.place + 1,
            **(_voted(who, voted[place]) if place in voted else {}),
            "run": "no" if met is None else "yes",
            **({} if met is None else {"claims met": met[0], "claims": met[1]}),
        }
    if not places:
        yield {**own, "run": "no"}


def _voted(who: str, held: Held) -> dict[str, object]:
    asked, rounds = held.poll.question, held.poll.rounds
    first, second = (rounds[k].get(who) if k < len(rounds) else None for k in (0, 1))
    last = first if second is None else second
    hit = None if last is None else asked.hits(last, held.truth)
    return {
        "first vote": answer(held, first),
        "second vote": answer(held, second),
        "right": "" if hit is None else "yes" if hit else "no",
        "measured": "" if math.isnan(held.truth) else f"{held.truth:.4g}",
    }


def answer(held: Held, vote: float | None) -> str:
    """Returns a vote as text: the letter of an option, or a number."""
    if vote is None:
        return ""
    return LETTERS[int(vote)] if isinstance(held.poll.question, Choice) else f"{vote:.3g}"


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
