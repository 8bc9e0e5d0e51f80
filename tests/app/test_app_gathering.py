"""The data of a class: steps, votes, members and the table."""

from __future__ import annotations

import csv
import io
import math
from dataclasses import replace

import pytest

from app.classes.gathering import MEMBERS, NAME, Gathering
from app.classes.views import course, for_all, for_teacher, table
from app.link.exercise import Lecture, LessonPlace
from lessons.course import COURSE, load_lesson
from lessons.teaching.prediction import Choice, Sketch, Value
from robots import InputError

STEPS = {
    kind: LessonPlace(name, place)
    for name in COURSE
    for place, step in enumerate(load_lesson(name).steps)
    for kind in (type(step.prediction),)
}
CHOICE, VALUE, SKETCH, NOTHING = STEPS[Choice], STEPS[Value], STEPS[Sketch], STEPS[type(None)]


def of(place: LessonPlace = CHOICE) -> Gathering:
    """Returns a class with a learner and a phone at a step."""
    return Gathering().entered("zoe", "robot", 0.0).entered("max", "phone", 0.0).going_to(place)


def lecture(place: LessonPlace, answer: float | None = None, over: bool = False) -> Lecture:
    phase = "done" if over else "waiting"
    return Lecture(place, phase, int(over), 0.0, 1.0, answer=answer, holds=(True, False, None))


def test_a_vote_goes_from_open_to_decided() -> None:
    hall = of()
    assert hall.stage == "waiting"
    with pytest.raises(InputError, match="no vote is open"):
        hall.voted("max", 0, 1.0)
    hall = hall.opened().voted("max", 1, 1.0).seen("zoe", CHOICE, lecture(CHOICE, 0), 2.0)
    assert (hall.stage, dict(hall.poll.latest if hall.poll else {})) == ("open", {"max": 1, "zoe": 0})
    assert for_all(hall)["rounds"] == [] and for_all(hall)["voted"] == 2, "nobody sees answers meanwhile"
    hall = hall.closed()
    late = hall.seen("zoe", CHOICE, lecture(CHOICE, 1), 3.0)
    assert late.poll == hall.poll
    with pytest.raises(InputError, match="closed"):
        hall.voted("max", 0, 3.0)
    assert sum(bar["count"] for bar in for_all(hall)["rounds"][0]) == 2
    hall = hall.opened().seen("zoe", CHOICE, lecture(CHOICE, 0), 4.0)
    assert len(for_all(hall)["rounds"]) == 1 and hall.poll and dict(hall.poll.latest) == {"zoe": 0}
    hall = hall.started()
    assert hall.stage == "running" and hall.poll and not hall.poll.is_open
    asked = hall.poll.question
    assert isinstance(asked, Choice)
    truth = next(
        x
        for x in (each.low if math.isfinite(each.low) else each.high - 1 for each in asked.options)
        if asked.right(x) is not None
    )
    hall = hall.measured(truth)
    assert hall.stage == "decided"
    said = for_all(hall)["result"]
    assert said.startswith("The run gave ") and "of 1 " in said and "In the first vote:" in said
    with pytest.raises(InputError, match="has run"):
        hall.opened()
    assert hall.going_to(CHOICE).opened().stage == "open"


@pytest.mark.parametrize(("place", "says"), [(SKETCH, "curve"), (NOTHING, "no question")])
def test_a_step_without_a_question_is_only_run(place: LessonPlace, says: str) -> None:
    with pytest.raises(InputError, match=says):
        of(place).opened()
    assert for_all(of(place))["asked"] is None
    assert of(place).started().measured(math.nan).stage == "waiting"


def test_without_a_step_there_is_nothing_to_do() -> None:
    for does in (Gathering.opened, Gathering.started):
        with pytest.raises(InputError, match="choose a step"):
            does(Gathering())
    with pytest.raises(InputError, match="no vote"):
        of().closed()


def test_a_robot_without_a_prediction_runs_with_the_favourite() -> None:
    hall = of(CHOICE).opened().voted("max", 1, 0.0)
    assert hall.guess() == 1 and type(hall.guess()) is int
    assert isinstance(of(VALUE).guess(), float) and isinstance(of(SKETCH).guess(), tuple)
    assert of(NOTHING).guess() is None


def test_the_teacher_sees_what_a_learner_did() -> None:
    hall = of().called("zoe", "  Zoë\n<b>" + "x" * 100)
    hall = hall.seen("zoe", CHOICE, lecture(CHOICE), 10.0).seen("zoe", CHOICE, lecture(CHOICE), 50.0)
    (row,) = for_teacher(hall, 70.0)["rows"]
    assert row["quiet"] == 60 and row["with"] and row["done"] == 0 and row["vote"] == ""
    assert row["name"].startswith("Zoë <b>") and len(row["name"]) <= NAME
    hall = hall.opened().seen("zoe", CHOICE, lecture(CHOICE, 1, over=True), 80.0)
    (row,) = for_teacher(hall, 80.0)["rows"]
    assert (row["quiet"], row["done"], row["met"], row["claims"], row["vote"]) == (0, 1, 1, 3, "B")
    away = hall.seen("zoe", VALUE, None, 90.0)
    assert not for_teacher(away, 90.0)["rows"][0]["with"]
    assert for_teacher(hall.left("max"), 90.0)["phones"] == 0


def test_a_learner_who_comes_back_keeps_votes_and_progress() -> None:
    hall = of().opened().seen("zoe", CHOICE, lecture(CHOICE, 1, over=True), 1.0)
    assert hall.succeeded("new", ["other", "zoe"]) == hall, "while the page is open nobody takes its place"
    again = hall.left("zoe").succeeded("new", ["zoe"]).entered("new", "robot", 2.0)
    assert "zoe" not in again.members and again.members["new"].number == hall.members["zoe"].number
    assert again.poll and dict(again.poll.latest) == {"new": 1}


def rows_of(hall: Gathering) -> list[dict[str, str]]:
    return list(csv.DictReader(io.StringIO(table(hall))))


def test_the_table_has_votes_and_progress_and_no_formula() -> None:
    hall = of(VALUE).called("zoe", "=1+1").opened().voted("max", VALUE_IN_THE_MIDDLE, 0.0).closed().opened()
    hall = hall.voted("max", VALUE_IN_THE_MIDDLE, 0.0).started().measured(VALUE_IN_THE_MIDDLE)
    hall = hall.seen("zoe", VALUE, lecture(VALUE, over=True), 5.0)
    zoe, max_ = rows_of(hall.going_to(CHOICE))
    assert zoe["name"] == "'=1+1" and (zoe["run"], zoe["claims met"], zoe["claims"]) == ("yes", "1", "3")
    assert (max_["kind"], max_["lesson"], max_["step"]) == ("phone", VALUE.lesson, str(VALUE.place + 1))
    assert max_["first vote"] == max_["second vote"] == f"{VALUE_IN_THE_MIDDLE:.3g}"
    assert (max_["right"], max_["run"]) == ("yes", "no")
    lines = table(hall).splitlines()
    assert len(lines) == 3 and lines[0].startswith("number,name,kind")


def middle() -> float:
    asked = load_lesson(VALUE.lesson).steps[VALUE.place].prediction
    assert isinstance(asked, Value)
    return math.sqrt(asked.low * asked.high)


VALUE_IN_THE_MIDDLE = middle()


def test_without_names_no_name_is_kept() -> None:
    hall = replace(of(), named=False).called("zoe", "Zoë")
    assert hall.members["zoe"].name == "" and for_teacher(hall, 0.0)["rows"][0]["name"] == ""
    assert "name" not in rows_of(hall)[0] and not for_all(hall)["named"]


def test_a_full_class_makes_room_only_where_nobody_voted() -> None:
    hall = of().opened().voted("max", 0, 0.0)
    crowd = {str(k): replace(hall.members["max"], number=k + 3, here=False) for k in range(MEMBERS - 2)}
    full = replace(hall, members={**hall.members, **crowd})
    one_more = full.entered("new", "phone", 1.0)
    assert len(one_more.members) == MEMBERS and "max" in one_more.members and "new" in one_more.members
    present = {who: replace(each, here=True) for who, each in full.members.items()}
    with pytest.raises(InputError, match="no more"):
        replace(full, members=present).entered("new", "phone", 1.0)


def test_the_course_of_the_teacher_is_the_whole_course() -> None:
    found = course()
    assert [each["name"] for each in found] == list(COURSE)
    assert found[0]["title"].startswith("1 · ") and all(each["steps"] for each in found)
    assert {step["asks"] for each in found for step in each["steps"]} <= {"", "choice", "number", "curve"}
