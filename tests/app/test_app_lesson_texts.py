"""Progress, texts, words and pictures of the lessons, and the cards of their exercises."""

from __future__ import annotations

import asyncio
import math
import re
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace
from html import escape
from unittest.mock import MagicMock

import numpy as np
import pytest

from app.html.markdown import explained, rendered, rendered_line, split, word_count, words
from app.html.palette import GHOST
from app.html.text import figure, formula, joints_named, readable
from app.link.exercise import Lecture, LessonPlace, Predict, SignalCurve
from app.panels.lesson.cards import GROUPS, PATHS, belonging_to, card, exercise_cards, glyph
from app.panels.lesson.claims import pictures, state
from app.panels.lesson.drawing import TRUTH, Bound, Line, chart, scale, sketch
from app.panels.lesson.prediction import Asking
from app.panels.widgets.controls import STEPS, place_of, value_at
from app.tab.visitor import Notebook
from himpc.tasks import KINDS
from lessons.course import COURSE, load_lesson
from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.replay.progress import LearnerProgress, progress_from
from lessons.teaching.prediction import Choice, PredictionResult, Value

CALLED = {
    "com": "centre of mass",
    "relative_position": "relative pose",
    "relative_orientation": "relative pose",
    "relative_pose": "relative pose",
    "plane_distance": "distance to a plane",
}
"""Kinds of tasks whose name on the command line differs from the word in the glossary."""


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_task_is_a_word_with_its_unit(kind: str) -> None:
    meaning = words()[CALLED.get(kind, kind)]
    unitless = ("pose", "damping")  # a pose consists of two kinds, and damping has no target
    assert kind in unitless or " in m" in meaning or " in rad" in meaning


def test_progress_survives_the_browser_and_whatever_stands_there() -> None:
    progress = (
        LearnerProgress().with_step("deadlines", 0).with_step("deadlines", 2).with_points("deadlines", 40.0)
    )
    progress = progress.with_points("deadlines", 30.0)
    assert progress.best["deadlines"] == 40.0 and progress.next_step("deadlines", 4) == 1
    assert progress.next_step("one-task", 4) == 0
    assert progress_from(progress.dumped()) == progress
    for text in (None, "", "{", "[]", "3", '{"seen": 3, "best": []}', "[" * 100_000):
        assert progress_from(text) == LearnerProgress()
    hostile = '{"seen": {"deadlines": [0, "1", -2, 1e9, true], "<b>": [1]}, "best": {"deadlines": 1e400}}'
    assert progress_from(hostile) == LearnerProgress({"deadlines": frozenset({0})})


def test_every_lesson_is_in_one_group_and_the_paths_fit_their_time() -> None:
    grouped = [name for _, names in GROUPS.values() for name in names]
    assert sorted(grouped) == sorted(COURSE) and all(names for _, names in GROUPS.values())
    assert len({glyph(name) for name in COURSE}) == len(COURSE), "every lesson has its own picture"
    minutes = {words: sum(load_lesson(name).card.minutes for name in names) for words, names in PATHS.items()}
    assert minutes["Ten minutes"] <= 10 and minutes["An hour"] <= 60


def test_a_text_is_split_after_a_sentence() -> None:
    text = "The *hand* follows $x = f(q). T$ (2). It stays within 1.5 mm.\n\n$$y. Z$$\n\nThen it rests!"
    assert split(text, 1) == (
        "The *hand* follows $x = f(q). T$ (2).",
        "It stays within 1.5 mm.\n\n$$y. Z$$\n\nThen it rests!",
    )
    assert split(text, 8) == split(text, 1) and split(text, 100) == (text, "")  # a formula is not cut off
    assert word_count(text) == 12
    for name in COURSE:
        for step in load_lesson(name).steps:
            first, rest = split(step.why, 60)
            assert word_count(first) + word_count(rest) == word_count(step.why) and word_count(first) <= 60


def test_a_notebook_saves_only_what_is_new() -> None:
    saved: list[str] = []
    notebook = Notebook(LearnerProgress(), saved.append)
    for _ in range(3):
        notebook.note(notebook.progress.with_step("one-task", 1))
    assert len(saved) == 1 and progress_from(saved[0]) == notebook.progress


@pytest.mark.parametrize("name", COURSE)
def test_every_text_renders(name: str) -> None:
    lesson = load_lesson(name)
    texts = [text for step in lesson.steps for text in (step.text, step.why, step.do)]
    for text in (*texts, *([lesson.challenge.text] if lesson.challenge else [])):
        html = rendered(text)
        assert "$" not in html and "\ue000" not in html and "<pre>" not in html
        assert html.count("<math") >= text.count("$$") // 2


def test_texts_are_markdown_with_equations_and_explained_words() -> None:
    html = rendered(r"The *level* has $a_1 < b_2$ and `level`; a level again.")
    assert html.count("<abbr") == 1 and "<em><abbr" in html and "<code>level</code>" in html
    assert "<math" in html and "&#x0003C;" in html
    assert "&lt;script&gt;" in rendered("<script>") and "<p>" not in rendered_line("a *b*")
    assert "<p><div" not in rendered("Before\n\n$$x = 1$$\n\nafter")


def test_words_are_explained_outside_of_tags_only() -> None:
    html = explained('<math><mi>plant</mi></math> <a title="plant">the plant</a>')
    assert html.count("<abbr") == 1 and '<a title="plant">the <abbr' in html
    assert {"level", "leak", "horizon", "plant", "M̄"} <= set(words())
    assert all(sentence.endswith(".") for sentence in words().values())


def test_places_of_a_logarithmic_slider_come_back() -> None:
    for low, high in ((0.1, 40.0), (1e-5, 100.0), (0.1, 1e6)):
        assert [place_of(value_at(k, low, high), low, high) for k in range(STEPS + 1)] == list(
            range(STEPS + 1)
        )


def test_pictures_show_numbers_for_people_and_survive_bad_ones() -> None:
    assert figure(0.012345, "mm") == "0.0123 mm" and figure(math.nan) == "–" and figure(30.0, "deg") == "30°"
    assert figure(3850.0, "%") == "3850 %" and figure(2e5) == "2·10⁵" and figure(2.0, "deg/s") == "2°/s"
    assert readable("turns by 3 deg, in degrees") == "turns by 3°, in degrees"
    assert readable("It was 3.56e+03 %, not 2.1e-07 deg.") == "It was 3560 %, not 2.1·10⁻⁷°."
    assert figure(-2.5e-9) == "−2.5·10⁻⁹"
    assert readable("9.96e-04 m and 9.97e+05 N") == "1·10⁻³ m and 1·10⁶ N"
    drawn = scale(0.1, 100.0, 5.0, 16.0, 1.5, "mm")
    assert "your guess 5 mm" in drawn and "measured 16 mm" in drawn
    assert "measured" not in scale(0.1, 100.0, 5.0, math.nan, 1.5, "mm")
    curve = SignalCurve(np.array([0.0, 0.5, 1.0]), np.array([math.nan, math.inf, 3.0]))
    lines, bounds = [Line("robot", TRUTH, curve), Line("<i>", GHOST, curve)], [Bound(1.0, "≤ 1 mm", "<b>")]
    drawn = chart("error", "mm", lines, bounds, [(0.5, "push")], 1.0, 220)
    assert "nan" not in drawn and "<b>" not in drawn and "<i>" not in drawn and ">≤ 1 mm<" in drawn
    assert ">0.51 s: –, ghost –<" in drawn and ">0.99 s: 3 mm, ghost 3 mm<" in drawn  # under the mouse
    nothing = SignalCurve(np.array([0.0]), np.array([math.nan]))
    assert chart("error", "mm", [Line("", TRUTH, nothing)], [], [], 1.0, 220) == ""
    assert "measured" in sketch(0.0, 6.0, 1.2, [(0.0, 1.0), (1.2, 2.0)], curve, "mm")


def graded(prediction: Value | Choice, answer: float, truth: float) -> Lecture:
    """Returns the state after a run that measured `truth`."""
    return Lecture(
        exercise=LessonPlace("one-task"),
        phase="done",
        attempt=1,
        t=1.0,
        duration=1.0,
        answer=answer,
        truth=truth,
        grade=PredictionResult(float(bool(prediction.hits(answer, truth))), "It was so."),
    )


def test_the_options_are_the_buttons_and_say_what_was_right() -> None:
    prediction = load_lesson("a-redundant-arm").steps[0].prediction
    assert isinstance(prediction, Choice)
    said: list[object] = []
    gui = MagicMock()
    options = [MagicMock(disabled=False) for _ in prediction.options]
    gui.add_button.side_effect = options
    asking = Asking(gui, prediction, said.append)
    labels = [call.args[0] for call in gui.add_button.call_args_list]
    assert labels == ["A   one or two", "B   three or four", "C   five or more"]
    with ThreadPoolExecutor(1) as elsewhere:
        elsewhere.submit(lambda: asyncio.run(options[0].on_click.call_args.args[0](None))).result()
    assert said == [Predict(0)] and options[0].label == "A   one or two   (your answer)"

    asking.show(graded(prediction, 0, 7.0))
    assert [each.label for each in options] == [
        "A   one or two   (✗ your answer)",
        "B   three or four",
        "C   five or more   (✓ measured: 7)",
    ]
    assert all(each.disabled for each in options)
    asking.show(graded(prediction, 2, 7.0))
    assert options[2].label == "C   five or more   (✓ your answer measured: 7)"


def test_a_claim_has_no_verdict_before_the_run_has_ended() -> None:
    part = load_lesson("a-redundant-arm").steps[0]
    lecture = Lecture(
        LessonPlace("a-redundant-arm"), "running", 1, 0.5, 2.0, values=(5.0, math.nan, 1.0),
        holds=(False, None, True),
    )  # fmt: skip
    running, done = (state(part, replace(lecture, phase=phase), None) for phase in ("running", "done"))
    assert "so far</b> 5, must be ≥ 7" in running and ">false<" not in running and "✗" not in running
    assert ">false<" in done and "✗" in done and "so far" not in done


def test_a_guess_that_came_too_late_is_not_drawn() -> None:
    """The picture shows the prediction that was graded, although the slider was moved afterwards."""
    prediction = next(
        each.prediction
        for name in COURSE
        for each in load_lesson(name).steps
        if isinstance(each.prediction, Value)
    )
    gui = MagicMock()
    picture, *_ = gui.add_html.side_effect = [MagicMock() for _ in range(3)]
    asking = Asking(gui, prediction, lambda _: None)
    slider = gui.add_slider.return_value
    slider.value = STEPS
    with ThreadPoolExecutor(1) as elsewhere:  # the browser of other tests has an event loop on this thread
        elsewhere.submit(lambda: asyncio.run(slider.on_update.call_args.args[0](MagicMock()))).result()
    assert figure(prediction.high, prediction.measure.unit) in picture.content
    kept = prediction.low * 2
    asking.show(graded(prediction, kept, kept))
    guess = re.findall(r">your guess ([^<]*)", picture.content)
    assert guess == [figure(kept, prediction.measure.unit)]


def test_a_joint_has_one_name() -> None:
    assert joints_named("error of q1 and joint_2, joint3 of joint 4") == (
        "error of joint 1 and joint 2, joint 3 of joint 4"
    )
    assert joints_named("panda_joint1, q, joint") == "panda_joint1, q, joint"
    part = next(
        step for step in load_lesson("two-tasks").steps if any("q1" in each.name for each in step.plots)
    )
    curve = SignalCurve(np.array([0.0, 1.0]), np.array([1.0, 2.0]))
    lecture = Lecture(LessonPlace("two-tasks"), "done", 1, 1.0, 1.0, curves=(curve,) * len(part.plots))
    drawn = pictures(part, lecture)
    assert "error of joint 1" in drawn and "q1" not in drawn
    claims = load_lesson("a-redundant-arm").steps[0].claims
    assert f"≥ {claims[0].bound:g}" in pictures(
        load_lesson("a-redundant-arm").steps[0], replace(lecture, curves=(curve,) * 3)
    ), "the predicted number of joints is plotted, with its bound"
    drawn = pictures(load_lesson("two-tasks").steps[1], lecture)
    assert "≥ 200 mm" in drawn and "≥ 100 mm" not in drawn, "of two bounds the stricter one"


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
