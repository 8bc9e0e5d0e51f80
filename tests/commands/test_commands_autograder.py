"""Grades in the formats of other systems, compared with the published descriptions (gradescope.json and
github_classroom.json, with their sources); and the folder of an autograder."""

from __future__ import annotations

import base64
import json
import math
import os
import shutil
import subprocess
import sys
from filecmp import dircmp
from pathlib import Path
from typing import Any

import pytest

from app.__main__ import main
from app.commands.grade import PACKAGES, requirements
from lessons.exercises import start_of
from lessons.exercises.result import CheckResult, Grade, github, gradescope

ROOT = Path(__file__).parents[2]
GRADESCOPE, GITHUB = (
    json.loads(Path(__file__).with_name(f"{name}.json").read_text())
    for name in ("gradescope", "github_classroom")
)
LINES = (
    CheckResult("It stays.", 0.1, "mm", "≤ 1 mm", 4, 4, ""),
    CheckResult("It comes back.", math.nan, "mm", "≤ 1 mm", 0, 6, "the robot was out of control at 0.20 s"),
)
GRADES = {
    "some": Grade("mine.py", "ab12", "joint-pd", LINES),
    "all": Grade("mine.py", "ab12", "joint-pd", LINES[:1]),
    "error": Grade("mine.py", "ab12", "", error="mine.py, line 1: expected ':'"),
}


def validate(found: Any, schema: dict[str, Any]) -> None:
    import jsonschema  # its import takes seconds, which all processes that collect the tests would need

    jsonschema.validate(found, schema)


@pytest.mark.parametrize("name", GRADES)
def test_a_grade_is_what_gradescope_reads(name: str) -> None:
    found = json.loads(json.dumps(gradescope(GRADES[name], "after_due_date"), allow_nan=False))
    validate(found, GRADESCOPE)
    assert found["score"] == sum(each["score"] for each in found["tests"]) == GRADES[name].points
    assert {each["visibility"] for each in (found, *found["tests"])} == {"after_due_date"}
    if name == "some":
        assert [each["status"] for each in found["tests"]] == ["passed", "failed"]
        assert [each["max_score"] for each in found["tests"]] == [4, 6]
        assert "out of control at 0.20 s" in found["tests"][1]["output"]
    if name == "error":
        assert "expected ':'" in found["output"]


@pytest.mark.parametrize("name", GRADES)
def test_a_grade_is_what_the_reporter_of_github_classroom_reads(name: str) -> None:
    """The sums are those that the reporter computes from the data that it decodes."""
    result = base64.b64encode(json.dumps(github(GRADES[name]), allow_nan=False).encode())
    found = json.loads(base64.b64decode(result))
    validate(found, GITHUB)
    points = sum(each["score"] for each in found["tests"])
    assert (points, found["max_score"]) == (GRADES[name].points, GRADES[name].of)
    assert found["status"] == {"some": "fail", "all": "pass", "error": "error"}[name]


def test_the_schemas_refuse_what_the_descriptions_do_not_have() -> None:
    import jsonschema

    wrong = gradescope(GRADES["some"])
    for change in ({"visibility": "never"}, {"points": 3}, {"tests": [{"name": "no score"}]}):
        with pytest.raises(jsonschema.ValidationError):
            validate({**wrong, **change}, GRADESCOPE)
    with pytest.raises(jsonschema.ValidationError):
        validate({**github(GRADES["some"]), "tests": []}, GITHUB)


def test_the_folder_of_an_autograder_grades_a_submission(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """The test does what the container does: the folder is /autograder/source, and `run_autograder` gets a
    submission. Only the installation is left out. This environment replaces that of requirements.txt, and its
    himpc-lab, which is compiled already, replaces the equal copy in the folder."""
    source = tmp_path / "source"
    assert main(["grade", "--autograder", "joint-pd", "--out", str(source)]) == 0
    assert "zip" in capsys.readouterr().out
    for name in ("setup.sh", "run_autograder"):  # "must contain at least two files in the root"
        text = (source / name).read_text()
        assert text.startswith("#!/")  # "an executable script (with appropriate #! line)"
        assert os.access(source / name, os.X_OK)
        assert subprocess.run(["bash", "-n", str(source / name)]).returncode == 0
        assert "joint-pd" in text
    for name in PACKAGES:
        compared = dircmp(ROOT / name, source / name)
        assert (compared.right_only, compared.diff_files, compared.funny_files) == ([], [], [])
        assert set(compared.left_only) <= {"__pycache__"}
        shutil.rmtree(source / name)
    submission, results = tmp_path / "submission", tmp_path / "results"
    submission.mkdir()
    results.mkdir()
    (submission / "work.py").write_text(start_of("joint-pd"))
    environment = {**os.environ, "AUTOGRADER": str(tmp_path), "PYTHON": sys.executable}
    environment.pop("PYTHONPATH", None)
    done = subprocess.run([str(source / "run_autograder")], env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    found = json.loads((results / "results.json").read_text())
    validate(found, GRADESCOPE)
    assert len(found["tests"]) == 4
    assert found["extra_data"]["exercise"] == "joint-pd"
    assert found["score"] < 10
    assert main(["grade", "--autograder", "joint-pd", "--out", str(source)]) == 2
    assert "does not exist yet" in capsys.readouterr().err


def test_an_autograder_installs_the_versions_of_this_machine() -> None:
    found = dict(each.split("==") for each in requirements())
    assert {"numpy", "numba", "pin", "mujoco", "daqp", "matplotlib", "llvmlite"} <= set(found)
    assert "pytest" not in found


def test_whatever_is_handed_in_has_a_grade_in_the_format(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = tmp_path / "results.json"
    place = tmp_path / "submission"
    place.mkdir()
    line = ["grade", str(place), "joint-pd", "--json", str(target), "--format"]
    assert main([*line, "gradescope"]) == 2
    found = json.loads(target.read_text())
    validate(found, GRADESCOPE)
    assert "hand in one Python file: found none" in found["output"]
    (place / "a.py").write_text("def torque(now)\n")
    assert main([*line, "github"]) == 2
    found = json.loads(target.read_text())
    validate(found, GITHUB)
    assert "expected ':'" in found["tests"][0]["message"]
    assert main(["grade", str(place), "joint-dp", "--format", "github"]) == 2
    assert "did you mean 'joint-pd'" in capsys.readouterr().err
