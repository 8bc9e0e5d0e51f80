"""Exercises on the page: a card each, and at the end of the lesson they belong to."""

from __future__ import annotations

import pytest

from app.html.text import figure, readable
from app.panels.lesson.exercise_cards import belonging_to, exercise_cards
from lessons.course import COURSE
from lessons.exercises import EXERCISES, load_exercise, start_of


@pytest.mark.parametrize("name", EXERCISES)
def test_an_exercise_has_its_card_and_ends_its_lesson(name: str) -> None:
    exercise = load_exercise(name)
    for html in (exercise_cards(), belonging_to(exercise.lesson)):
        assert f"--from {name}" in html
        assert f"--scene {exercise.scene} --controller" in html


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
