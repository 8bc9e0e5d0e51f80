"""The votes and the progress of a class as a table for a spreadsheet."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator

from app.classes.gathering import Gathering, Held
from app.classes.member import Member
from lessons.exercises.folder import cell
from lessons.teaching.prediction import Choice

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
