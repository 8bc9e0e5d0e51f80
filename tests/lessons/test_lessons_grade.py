"""Grading gives all points to a correct solution, and a known mistake fails the check that is made for it."""

from __future__ import annotations

import multiprocessing
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import closing
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from right_laws import PD, STYLES
from submissions import MISTAKES, SUBMISSIONS

from himpc.controllers.answers import OwnFault
from himpc.controllers.view import View
from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.exercises.folder import Row, grade_folder
from lessons.exercises.grade import WITHIN, Submission, grade, grade_apart, judged_by
from lessons.exercises.result import CheckResult, Grade
from lessons.own.files import Source, execute, sentence
from lessons.own.kinds import law_of
from lessons.parallel import on_cores, one_by_one
from lessons.scenes.catalog import as_torque_scene
from lessons.session.torque import TorqueSession
from robots import InputError

CASES = [(exercise, name) for exercise, known in MISTAKES.items() for name in known]


@pytest.fixture
def file(tmp_path: Path):
    def write(text: str, name: str = "mine.py") -> str:
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


@pytest.fixture(scope="module")
def marked() -> Iterator[Callable[..., Grade]]:
    """Runs `grade` or `grade_apart` in a process with one thread, as the command does; the process imports
    the common modules once."""
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        yield lambda grader, *args: pool.submit(grader, *args).result()


@dataclass(frozen=True)
class Graded:
    """The results of a folder: its table, as returned and as written, and the grade of each file."""

    rows: list[Row]
    table: str
    grades: dict[str, Grade]
    shares: list[float]


@pytest.fixture(scope="module")
def thirty(tmp_path_factory: pytest.TempPathFactory) -> Graded:
    """The grades of all submissions, computed on all cores."""
    place, shares, grades = tmp_path_factory.mktemp("thirty"), [], {}

    def kept(function: Callable[[Any], Any], items: Sequence[Any]) -> Generator[tuple[int, Any]]:
        for at, found in on_cores(function, items):
            grades[Path(items[at].source.path).stem] = found
            yield at, found

    out, folder = place / "grades.csv", folder_of(place / "all", list(SUBMISSIONS))
    rows = grade_folder(folder, None, 0, out, kept, shares.append)
    return Graded(rows, out.read_text(), grades, shares)


@dataclass(frozen=True)
class Near:
    """Runs a submission in this process and starts no new process; it is used for submissions that are wrong
    but do not misbehave."""

    source: Source

    @property
    def where(self) -> str:
        return self.source.path

    def fresh(self) -> Callable[[View], Any]:
        law = law_of(execute(self.source))()

        def told(now: View) -> Any:
            try:
                return law(now)
            except Exception as error:
                raise OwnFault(sentence(self.source.path, error)) from None

        return told


def here(text: str, exercise: str, about: str = "") -> tuple[CheckResult, ...]:
    """Returns the results of the checks whose text contains `about`, computed without a separate process."""
    whole = load_exercise(exercise)
    chosen = replace(whole, checks=lambda seed: tuple(c for c in whole.checks(seed) if about in c.text))
    return judged_by(chosen, Near(Source("mine.py", text)), 0)


@pytest.mark.parametrize("exercise", EXERCISES)
def test_right_solution_gets_every_grade_point(exercise: str, thirty: Graded) -> None:
    found = thirty.grades[f"right_{exercise.replace('-', '_')}"]
    assert (found.exercise, found.passed) == (exercise, True)
    lines = found.lines
    assert [line.check for line in lines if line.why] == [], lines
    assert sum(line.of for line in lines) == 10


CONTROL_LAWS = pytest.mark.nightly(
    "himpc/controllers/own.py",
    "himpc/controllers/view",
    *(f"lessons/exercises/{name}." for name in ("exercise", "grade", "laws", "mistakes")),
    *(f"lessons/exercises/{name.replace('-', '_')}." for name in EXERCISES),
)
"""The mark of tests that judge all known solutions and mistakes."""


@CONTROL_LAWS
@pytest.mark.parametrize("exercise", EXERCISES)
def test_a_right_solution_in_any_style_gets_every_grade_point(exercise: str) -> None:
    """Each exercise has at least three styles of solutions; `thirty` contains the first of them."""
    first, *others = STYLES[exercise]
    assert SUBMISSIONS[f"right_{exercise.replace('-', '_')}"].text == first
    assert len(others) >= 2
    for text in others:
        assert [line.check for line in here(text, exercise) if line.why] == []


@CONTROL_LAWS
@pytest.mark.parametrize(("exercise", "name"), CASES)
def test_a_known_mistake_costs_grade_points_and_is_named(exercise: str, name: str) -> None:
    known = MISTAKES[exercise][name]
    lines = here(known.text(exercise), exercise)
    assert sum(line.points for line in lines) <= known.most
    whys = [line.why for line in lines if line.why]
    named = [why for why in whys if known.words in why]
    assert named, whys
    assert any(known.fails in line.check for line in lines if line.why)
    # Other messages name a failure of the code itself, for example a number that is not finite.
    assert all(why.startswith("mine.py") for why in whys if why not in named), whys


@pytest.mark.parametrize("exercise", EXERCISES)
def test_every_grade_check_is_told_apart_by_a_mistake(exercise: str) -> None:
    """For each exercise there are at least eight mistakes, and the events of its checks are accepted."""
    assert len(MISTAKES[exercise]) >= 8
    for check in load_exercise(exercise).checks(0):
        session = TorqueSession(as_torque_scene(check.run.prepared(), "it"))
        for _, event in check.run.events or ():
            session.post(event)
        session.drain()
        assert session.notices == []


@pytest.mark.parametrize("exercise", EXERCISES)
def test_the_file_with_the_hole_runs_and_its_grade_is_not_full(exercise: str) -> None:
    assert f'EXERCISE = "{exercise}"' in start_of(exercise)
    lines = here(start_of(exercise), exercise)
    assert sum(1 for line in lines if line.why) > 0
    assert not any("Error" in line.why for line in lines)


MISBEHAVING = {
    "syntax": ("def torque(now)\n", "expected ':'"),
    "no exercise": ("def torque(now):\n    return now.bias\n", "has no name of an exercise"),
    "leaves": ("import os\nEXERCISE = 'joint-pd'\nos._exit(0)\n", "ends its own process (exit code 0)"),
    "crashes": ("import os\nEXERCISE = 'joint-pd'\nos.abort()\n", "ends its own process (signal 6)"),
}


@pytest.mark.parametrize("what", MISBEHAVING)
def test_what_cannot_be_graded_is_a_sentence(what: str, file, marked) -> None:
    text, words = MISBEHAVING[what]
    found = marked(grade, file(text))
    assert words in found.error
    assert (found.points, found.passed) == (0, False)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("open('/tmp/himpc-grade', 'w')", "may not do that"),
        ("open('/etc/hostname').read()", "may not do that"),
        ("import subprocess; subprocess.run(['true'])", "may not do that"),
        ("import os; os.system('true')", "may not do that"),
        ("now.q[0] = 3", "read-only"),
        ("print('x' * 10**5)", ""),  # more than a pipe can hold
        ("[0] * 10**13", "memory"),
    ],
)
def test_what_a_submission_must_not_do_costs_it_the_grade(text: str, words: str, file, marked) -> None:
    body = f"    {text}\n    return now.gravity\n"
    found = marked(grade, file(f"EXERCISE = 'joint-pd'\ndef torque(now):\n{body}"))
    assert found.lines
    assert not found.passed
    assert any(words in line.why for line in found.lines)
    assert not Path("/tmp/himpc-grade").exists()


def test_a_grade_comes_out_the_same_twice(file, marked) -> None:
    path = file(PD.replace("now.gravity +", "0.9 * now.gravity +"))
    assert marked(grade, path, "joint-pd", 3) == marked(grade, path, "joint-pd", 3)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("while True: pass", "takes longer than 2 s"),
        ("import time; time.sleep(100)", "takes longer than 2 s"),
        ("    import time; time.sleep(0.4); return now.gravity", "takes longer than 2 s"),
    ],
    ids=["endless when loaded", "sleeps when loaded", "sleeps a little, always"],
)
def test_what_never_ends_is_ended_and_its_grade_is_a_sentence(
    text: str, words: str, tmp_path: Path, marked
) -> None:
    law = (
        f"def torque(now):\n{text}\n" if text.startswith(" ") else f"{text}\ndef torque(now): return now.q\n"
    )
    source = Source(str(tmp_path / "mine.py"), law)
    found = marked(grade_apart, Submission(source, "joint-pd", within=replace(WITHIN, seconds=2.0)))
    assert words in found.error
    assert found.points == 0


def test_a_grade_needs_no_file_where_it_is_made(tmp_path: Path) -> None:
    """A worker on another machine of a cluster cannot read the files of the grading machine."""
    source = Source("far/away/mine.py", "def torque(now):\n    return now.q[:2]\n")
    found = grade_apart(Submission(source, "joint-pd"))
    assert found.file == "far/away/mine.py"
    assert found.lines[0].why.startswith("far/away/mine.py, line 1: ")


def folder_of(place: Path, names: Sequence[str]) -> Path:
    place.mkdir()
    for name in names:
        (place / f"{name}.py").write_text(SUBMISSIONS[name].file)
    return place


def test_thirty_submissions_get_the_grades_they_deserve(thirty: Graded, tmp_path: Path, marked) -> None:
    """No submission loses points because of another submission, and a second grading gives the same table."""
    assert len(thirty.rows) == len(SUBMISSIONS)
    found = {row["file"].removesuffix(".py"): row for row in thirty.rows}
    assert {name: int(row["points"]) for name, row in found.items()} == {
        name: each.points for name, each in SUBMISSIONS.items()
    }
    for name, each in SUBMISSIONS.items():
        assert each.words in found[name]["missed"] + found[name]["error"], name
    assert thirty.shares[-1] == 1.0

    def one_process(function: Callable[[Any], Any], items: Sequence[Any]) -> Generator[tuple[int, Any]]:
        yield from one_by_one(partial(marked, function), items)

    few = ["wrong_kills", "wrong_leaves", "wrong_sign"]
    beside = tmp_path / "again.csv"
    grade_folder(folder_of(tmp_path / "few", few), None, 0, beside, one_process, lambda _: None)
    assert len(beside.read_text().splitlines()) == 1 + len(few)
    assert set(beside.read_text().splitlines()) < set(thirty.table.splitlines())


def test_grades_of_a_folder_are_carried_on(tmp_path: Path, marked) -> None:
    """After an interruption and a change of one file, files that were already graded are not graded again."""
    graded: list[str] = []

    def counted(function, items) -> Generator:
        graded[:] = [Path(each.source.path).name for each in items]
        yield from one_by_one(partial(marked, function), items)

    def stopped(function, items) -> Generator:
        with closing(one_by_one(partial(marked, function), items)) as outcomes:
            yield next(outcomes)
        raise KeyboardInterrupt

    names, out = ["wrong_leaves", "wrong_syntax"], tmp_path / "grades.csv"
    held = folder_of(tmp_path / "held", names)
    with pytest.raises(KeyboardInterrupt):
        grade_folder(held, None, 0, out, stopped, lambda _: None)
    assert len(out.read_text().splitlines()) == 2
    grade_folder(held, None, 0, out, counted, lambda _: None)
    assert graded == ["wrong_syntax.py"]
    before = out.read_text().splitlines()
    (held / "wrong_syntax.py").write_text("def torque(now): return 1\n}")
    grade_folder(held, None, 0, out, counted, lambda _: None)
    after = out.read_text().splitlines()
    assert graded == ["wrong_syntax.py"]
    assert after[1] == before[1]
    assert after[2] != before[2]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [("empty", None, "no Python file"), ("other", "a,b\n1,2\n", "is not a table of himpc-lab grade")],
)
def test_a_folder_that_cannot_be_graded_is_a_sentence(name, text, words, tmp_path: Path) -> None:
    out = tmp_path / "grades.csv"
    if text is not None:
        out.write_text(text)
        (tmp_path / "one.py").write_text("")
    with pytest.raises(InputError, match=words):
        grade_folder(tmp_path, None, 0, out, one_by_one, lambda _: None)
