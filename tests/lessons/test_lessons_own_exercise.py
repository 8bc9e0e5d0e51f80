"""A teacher's own exercises: the template is a valid exercise, the proof finds what is wrong with an
exercise, and submissions are graded like those for the exercises of the lab."""

from __future__ import annotations

import csv
from dataclasses import replace
from pathlib import Path

import pytest

from lessons.authoring.new import text_of
from lessons.exercises.folder import grade_folder
from lessons.exercises.grade import Submission, grade_only
from lessons.exercises.own import exercise_in, filled
from lessons.exercises.prove import Proof, prove
from lessons.exercises.result import Grade
from lessons.own.files import Source
from lessons.parallel import one_by_one
from robots import InputError


@pytest.fixture(scope="module")
def file(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The template in the form in which `himpc-lab new exercise` writes it."""
    path = tmp_path_factory.mktemp("own") / "pd.py"
    path.write_text(text_of("exercise", None, "pd.py"))
    return str(path)


@pytest.fixture(scope="module")
def proof(file: str) -> Proof:
    return prove(file, 0, one_by_one, lambda _: None)


def test_the_template_is_an_exercise_that_can_be_used(proof: Proof) -> None:
    assert proof.faults == ()
    assert (proof.solution.points, proof.solution.of) == (10, 10)
    assert not proof.start.passed
    assert len(proof.mistakes) == len(proof.exercise.mistakes) == 3
    for says, grade in proof.mistakes:
        assert not grade.passed
        assert not grade.error
        assert any(says in line.why for line in grade.lines)


def with_points(grade: Grade, *given: int, why: str = "because") -> Grade:
    lines = tuple(
        replace(line, points=points, why="" if points else why)
        for line, points in zip(grade.lines, given, strict=True)
    )
    return replace(grade, lines=lines)


def test_the_proof_names_everything_that_must_be_mended(proof: Proof) -> None:
    """The measured grades are changed such that the exercise has one fault at a time."""
    (first, grade), *others = proof.mistakes
    changed = {
        "the solution misses the check": replace(proof, solution=with_points(proof.solution, 6, 0)),
        "the start already gets all points": replace(proof, start=proof.solution),
        f"the mistake '{first}' gets all points": replace(proof, mistakes=((first, proof.solution), *others)),
        f"the mistake '{first}' is not named": replace(
            proof, mistakes=((first, with_points(grade, 0, 0)), *others)
        ),
        "'The arm is at rest afterwards.' is passed by every mistake": replace(
            proof, mistakes=tuple((says, with_points(each, 0, 4, why=says)) for says, each in proof.mistakes)
        ),
        "the solution cannot be run: it ended": replace(
            proof, solution=replace(proof.solution, lines=(), error="it ended")
        ),
    }
    for words, each in changed.items():
        assert any(words in fault for fault in each.faults), words


def test_a_submission_to_an_own_exercise_is_graded_in_a_process_that_cannot_read_it(
    file: str, tmp_path: Path
) -> None:
    """The folder contains two submissions: one has a known mistake, and the other reads the solution in the
    exercise."""
    whole = exercise_in(file)
    (tmp_path / "wrong.py").write_text(whole.mistakes[0].text)
    (tmp_path / "cheat.py").write_text(f"text = open({file!r}).read()\n{whole.solution}")
    out = tmp_path / "grades.csv"
    rows = grade_folder(tmp_path, file, 0, out, one_by_one, lambda _: None)
    found = {row["file"]: row for row in rows}
    assert {name: row["points"] for name, row in found.items()} == {"cheat.py": "0", "wrong.py": "0"}
    assert whole.mistakes[0].says in found["wrong.py"]["missed"]
    assert "may not" in found["cheat.py"]["error"]
    assert {row["exercise"] for row in rows} == {"my-exercise"}
    assert next(csv.DictReader(out.open()))["asked"].startswith("pd.py@")


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("EXERCISE = 'joint-pd'\nraise SystemExit\n", "is not the file of an exercise"),
        ("def torque(now): return now.q\nEXERCISE = own_exercise()\n", "NameError: name 'own_exercise'"),
        ("EXERCISE = dict()\nraise SystemExit\n", "is not the file of an exercise"),
        ("own_exercise = dict\nEXERCISE = own_exercise()\n", "must be made with own_exercise"),
        ("EXERCISE = (\n", "is not the file of an exercise"),
    ],
)
def test_another_file_is_no_exercise(text: str, words: str, tmp_path: Path) -> None:
    """The first file is a student's file that a teacher named by mistake; none of its code is executed."""
    path = tmp_path / "mine.py"
    path.write_text(text)
    with pytest.raises(InputError, match=words):
        exercise_in(str(path))


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("# TODO:", "# do:", "no lines with TODO"),
        ("points=6", "points=0", "must give one point or more"),
        ('name="my-exercise"', "name=3", "name of the exercise must be a text"),
        (
            "    return (\n        GradeCheck(",
            "    return ()\n    return (\n        GradeCheck(",
            "one GradeCheck",
        ),
    ],
)
def test_what_is_wrong_with_an_own_exercise_is_a_sentence(
    old: str, new: str, words: str, file: str, tmp_path: Path
) -> None:
    text = Path(file).read_text()
    assert old in text
    path = tmp_path / "mine.py"
    path.write_text(text.replace(old, new, 1))
    with pytest.raises(InputError, match=words):
        exercise_in(str(path))


def test_missing_lines_are_filled_in_at_their_indentation() -> None:
    start = "def torque(now):\n    if now.n:\n        # TODO: here\n    return now.q\n"
    assert filled(start, "\n    a = 1\n    b = 2\n") == start.replace(
        "        # TODO: here", "        a = 1\n        b = 2"
    )


def test_an_error_counts_the_points_of_the_exercise(file: str, tmp_path: Path) -> None:
    assert Submission.to(file, Source("mine.py", "")).possible == 10
    for name in ("a.py", "b.py"):
        (tmp_path / name).write_text("")
    found = grade_only(tmp_path, file)
    assert (found.points, found.of) == (0, 10)
    assert found.error == "hand in one Python file: found a.py, b.py"
