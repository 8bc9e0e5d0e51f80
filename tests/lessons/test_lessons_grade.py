"""Grading: who did it right gets all points, a known mistake misses the check that is about it."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import pytest

from lessons.exercises import EXERCISES, load_exercise, start_of
from lessons.exercises.grade import grade, judged_by
from lessons.own.files import execute, read
from robots import InputError

TASK = """
def wanted(level):
    return (level.x_ddot_d[0] - level.K_v * (level.x_dot - level.x_dot_d[0]) - level.K_p * level.error)
"""
PD = (
    TASK
    + """
def torque(now):
    return now.gravity + now.M_bar * wanted(now.level("posture"))
"""
)
OSF = (
    TASK
    + """
import numpy as np

def torque(now):
    M_inv = np.linalg.inv(now.M)
    N, tau, torques = np.eye(now.n), np.zeros(now.n), []
    for level in now.levels:
        J = level.J @ N
        L = np.linalg.pinv(J @ M_inv @ J.T, rcond=1e-9, hermitian=True)
        tau = tau + J.T @ L @ (wanted(level) - level.J_dot_q_dot - level.J @ M_inv @ tau)
        N = N - M_inv @ J.T @ L @ J
        torques.append(now.bias + tau)
    return torques
"""
)
TDE = (
    TASK
    + """
def torque(now):
    return now.tau_0 + now.M_bar * (wanted(now.level("posture")) - now.q_ddot)
"""
)
QP = (
    start_of("two-levels")
    .replace('EXERCISE = "two-levels"', "")
    .replace(
        "        # TODO: for the second level the rows J₁ M̄⁻¹ with lower = upper = J₁ M̄⁻¹ Δτ₁.\n",
        "        if torques:\n"
        "            B, U = now.levels[0].J / now.M_bar, torques[0] - now.tau_0\n"
        "            rows = np.vstack([rows, B])\n"
        "            lower = np.r_[np.minimum(lower, rows[:-len(B)] @ U), B @ U]\n"
        "            upper = np.r_[np.maximum(upper, rows[:-len(B)] @ U), B @ U]\n",
    )
)
RIGHT = {"joint-pd": PD, "null-space": OSF, "time-delay": TDE, "one-level-qp": QP, "two-levels": QP}

WRONG: dict[str, tuple[str, str, str, str]] = {
    "pd: sign of K_p": ("joint-pd", "- level.K_p", "+ level.K_p", "comes back"),
    "pd: no gravity": ("joint-pd", "now.gravity +", "", "stays where it is"),
    "pd: no damping": ("joint-pd", "level.K_v *", "0.0 *", "calm"),
    "pd: never moves": ("joint-pd", "return now.gravity", "return now.tau_0", "calm"),
    "osf: missing J̇q̇": ("null-space", "- level.J_dot_q_dot", "", "OSF's"),
    "osf: no projection": ("null-space", "level.J @ N", "level.J", "reaches the hand"),
    "osf: transposed projector": ("null-space", "M_inv @ J.T @ L @ J", "J.T @ L @ J @ M_inv", "OSF's"),
    "osf: asks twice": ("null-space", "- level.J @ M_inv @ tau", "", "OSF's"),
    "tde: no q̈₀": ("time-delay", "- now.q_ddot", "", "that of the equation"),
    "tde: sign of q̈₀": ("time-delay", "- now.q_ddot", "+ now.q_ddot", "that of the equation"),
    "tde: the model instead": ("time-delay", "now.tau_0 +", "now.gravity +", "does not sag"),
    "qp: no bounds": ("one-level-qp", "solve_qp(H, f, rows,", "solve_qp(H, f, 0 * rows,", "stays within"),
    "qp: bound afterwards": (
        "one-level-qp",
        "solve_qp(H, f, rows, lower, upper).x",
        "np.clip(np.linalg.solve(H, -f), lower[: now.n], upper[: now.n])",
        "not a cut-off one",
    ),
    "qp: no velocity bound": ("one-level-qp", "- now.q_dot)", ") * 1e6", "At the velocity bound"),
    "qp: sign of f": ("one-level-qp", "G.T @ (level.Q * e)", "-G.T @ (level.Q * e)", "With room to spare"),
    "qp: no R": ("one-level-qp", "np.diag(level.R)", "1e-3 * np.eye(now.n)", "weights count"),
    "two: weighted, not strict": ("two-levels", "if torques:", "if False:", "Nothing leaks"),
    "two: no bound": ("two-levels", "now.tau_0, (share", "1e3, (share", "gives way"),
    "two: reference of this tick": ("two-levels", "displacement_d[1]", "displacement_d[0]", "With room"),
}


@pytest.fixture
def file(tmp_path: Path):
    def write(text: str, name: str = "mine.py") -> str:
        path = tmp_path / name
        path.write_text(text)
        return str(path)

    return write


def here(path: str, exercise: str, about: str = ""):
    """The lines of the checks about something, without the process of its own."""
    execute(read(path))
    whole = load_exercise(exercise)
    chosen = replace(whole, checks=lambda seed: tuple(c for c in whole.checks(seed) if about in c.text))
    return judged_by(chosen, path, 0)


@pytest.mark.parametrize("exercise", EXERCISES)
def test_right_solution_gets_every_grade_point(exercise: str, file) -> None:
    lines = here(file(RIGHT[exercise]), exercise)
    assert [line.check for line in lines if line.why] == [], lines
    assert sum(line.of for line in lines) == 10


@pytest.mark.parametrize("what", WRONG)
def test_wrong_solution_loses_the_grade_points_of_its_mistake(what: str, file) -> None:
    exercise, good, bad, missed = WRONG[what]
    assert good in RIGHT[exercise]
    lines = here(file(RIGHT[exercise].replace(good, bad)), exercise, missed)
    assert [line.points for line in lines] == [0], lines


@pytest.mark.parametrize("exercise", EXERCISES)
def test_the_file_with_the_hole_runs_and_its_grade_is_not_full(exercise: str, file) -> None:
    assert f'EXERCISE = "{exercise}"' in start_of(exercise)
    lines = here(file(start_of(exercise)), exercise)
    assert sum(1 for line in lines if line.why) > 0
    assert not any("Error" in line.why for line in lines)


MISBEHAVING = {
    "syntax": ("def torque(now)\n", "expected ':'"),
    "no exercise": ("def torque(now):\n    return now.bias\n", "does not say which exercise"),
    "leaves": (
        "import os\nEXERCISE = 'joint-pd'\ndef torque(now):\n    os._exit(0)\n",
        "ended by",
    ),
    "crashes": ("import os\nEXERCISE = 'joint-pd'\ndef torque(now):\n    os.abort()\n", "SIGABRT"),
}


@pytest.mark.parametrize("what", MISBEHAVING)
def test_what_cannot_be_graded_is_a_sentence(what: str, file) -> None:
    text, words = MISBEHAVING[what]
    found = grade(file(text))
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
        ("print('x' * 10**6)", ""),
        ("[0] * 10**13", "memory"),
    ],
)
def test_what_a_submission_must_not_do_costs_it_the_grade(text: str, words: str, file) -> None:
    body = f"    {text}\n    return now.gravity\n"
    found = grade(file(f"EXERCISE = 'joint-pd'\ndef torque(now):\n{body}"))
    assert found.lines
    assert not found.passed
    assert any(words in line.why for line in found.lines)
    assert not Path("/tmp/himpc-grade").exists()


def test_a_grade_comes_out_the_same_twice(file) -> None:
    path = file(PD.replace("now.gravity +", "0.9 * now.gravity +"))
    assert grade(path, "joint-pd", 3) == grade(path, "joint-pd", 3)


def test_a_folder_is_graded_into_one_table_that_carries_on(tmp_path: Path, monkeypatch) -> None:
    """The right ones get all points, nobody loses any through a neighbour, and twice it is the same table."""
    from lessons.exercises import folder as folders

    held = tmp_path / "held"
    held.mkdir()
    texts = {
        "anna": TDE,
        "ben": TDE.replace("- now.q_ddot", ""),
        "cleo": "import os\ndef torque(now):\n    os._exit(0)\n",
        "dan": "def torque(now)\n",
        "eve": "def torque(now):\n    return now.tau_0\n",
    }
    for name, text in texts.items():
        (held / f"{name}.py").write_text(text)
    out, shares = tmp_path / "grades.csv", []
    rows = folders.grade_folder(held, "time-delay", 0, out, shares.append)
    found = {row["file"].removesuffix(".py"): int(row["points"]) for row in rows}
    assert found["anna"] == 10
    assert 0 < found["ben"] < 10
    assert (found["cleo"], found["dan"]) == (0, 0)
    assert found["eve"] < 10
    assert "ended by the program" in rows[2]["error"]
    assert rows[3]["error"] == "dan.py, line 1: expected ':'"
    assert shares[-1] == 1.0
    text = out.read_text()
    graded = []

    def counted(path: str, *given):
        graded.append(Path(path).name)
        return grade(path, *given)

    monkeypatch.setattr(folders, "grade", counted)
    (held / "dan.py").write_text("def torque(now): return 1\n}")
    again = folders.grade_folder(held, "time-delay", 0, out, shares.append)
    assert graded == ["dan.py"]
    assert [row["points"] for row in again] == [row["points"] for row in rows]
    assert out.read_text().splitlines()[1] == text.splitlines()[1]


@pytest.mark.parametrize(
    ("name", "text", "words"),
    [("empty", None, "no Python file"), ("other", "a,b\n1,2\n", "is no table of himpc-lab grade")],
)
def test_a_folder_that_cannot_be_graded_is_a_sentence(name, text, words, tmp_path: Path) -> None:
    from lessons.exercises.folder import grade_folder

    out = tmp_path / "grades.csv"
    if text is not None:
        out.write_text(text)
        (tmp_path / "one.py").write_text("")
    with pytest.raises(InputError, match=words):
        grade_folder(tmp_path, None, 0, out, lambda _: None)
