"""Exercises on the page: each has a card, also at the end of the lesson to which it belongs."""

from __future__ import annotations

from html import escape

import pytest

from app.html.text import figure, formula, readable
from app.panels.lesson.cards import belonging_to, card, exercise_cards
from lessons.course import COURSE
from lessons.exercises import EXERCISES, load_exercise, start_of


@pytest.mark.parametrize("name", EXERCISES)
def test_an_exercise_has_its_card_and_ends_its_lesson(name: str) -> None:
    exercise = load_exercise(name)
    for html in (exercise_cards(), belonging_to(exercise.lesson)):
        assert f"--from {name}" in html
        assert f"--scene {exercise.scene} --controller" in html
        assert formula(exercise.equation) in html
        assert all(escape(check.text) in html for check in exercise.checks(0))


@pytest.mark.parametrize("name", EXERCISES)
def test_the_hints_of_an_exercise_open_one_by_one(name: str) -> None:
    """Each hint is nested inside the previous one."""
    hints = load_exercise(name).hints
    opened = card(load_exercise(name)).split("<summary>Hint ")
    assert [each[0] for each in opened[1:]] == [str(number) for number in range(1, len(hints) + 1)]
    assert "</details>" not in "".join(opened[1:-1])
    assert opened[-1].count("</details>") == len(hints)


@pytest.mark.parametrize("name", EXERCISES)
def test_the_file_with_the_hole_names_a_scene_of_its_checks(name: str) -> None:
    line = next(each for each in start_of(name).splitlines() if "--scene" in each)
    scenes = {check.run.scene for check in load_exercise(name).checks(0)}
    assert line.split("--scene ")[1].split()[0] in scenes


def test_other_lessons_lead_to_none() -> None:
    own = {load_exercise(name).lesson for name in EXERCISES}
    assert own <= set(COURSE)
    assert all((belonging_to(name) == "") == (name not in own) for name in COURSE)


def test_degrees_are_a_sign_after_a_number_and_a_word_elsewhere() -> None:
    assert figure(1.5, "deg") == "1.5°"
    assert figure(2.0, "deg/s") == "2°/s"
    assert readable("turns by 3 deg, in degrees") == "turns by 3°, in degrees"
