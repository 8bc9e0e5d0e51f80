"""`himpc-lab grade --autograder`: writes the folder of an autograder for Gradescope's containers."""

from __future__ import annotations

import re
import shutil
import sys
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path

from robots import InputError

PACKAGES = ("robots", "himpc", "lessons", "app")
_ROOT = Path(__file__).parents[2]

_SETUP = """#!/usr/bin/env bash
# Gradescope runs this once, as root, when the image is built; this folder is then /autograder/source.
set -e
root="${AUTOGRADER:-/autograder}"
export DEBIAN_FRONTEND=noninteractive
apt-get update
apt-get install -y libseccomp2 libgomp1
apt-get install -y python3.12 python3.12-venv || apt-get install -y python3.11 python3.11-venv
$(command -v python3.12 || command -v python3.11) -m venv "$root/venv"
"$root/venv/bin/pip" install -r "$root/source/requirements.txt"
# The controllers are compiled now, not with the first submission.
cd "$root/source"
"$root/venv/bin/python" -m app new controller /tmp/start.py --from EXERCISE
"$root/venv/bin/python" -m app grade /tmp/start.py EXERCISE || test $? -eq 1
"""
_RUN = """#!/usr/bin/env bash
# Gradescope runs this for every submission, and reads results/results.json.
root="${AUTOGRADER:-/autograder}"
cd "$root/source"
"${PYTHON:-$root/venv/bin/python}" -m app grade "$root/submission" EXERCISE \\
  --format gradescope --json "$root/results/results.json"
# Exit codes 1 and 2 say that points are missing, or that the file cannot be run: results.json says the same.
test -s "$root/results/results.json"
"""
_OWN = "exercise.py"


def write_autograder(exercise: str, folder: Path) -> int:
    """Writes the folder: `setup.sh`, `run_autograder`, the list of packages to install, and himpc-lab itself.

    Args:
        exercise: name of an exercise, or path of the file of a teacher's own exercise.
        folder: path of the folder, which must not exist yet.

    Raises:
        InputError: there is no such exercise, or the folder exists already or cannot be written.
    """
    from lessons.exercises.own import any_exercise
    from lessons.own.files import is_file

    any_exercise(exercise)
    own = is_file(exercise)
    try:
        folder.mkdir(parents=True)
        for name, text in (("setup.sh", _SETUP), ("run_autograder", _RUN)):
            (folder / name).write_text(text.replace("EXERCISE", _OWN if own else exercise), encoding="utf-8")
            (folder / name).chmod(0o755)
        if own:
            shutil.copy(exercise, folder / _OWN)
        (folder / "requirements.txt").write_text("\n".join(requirements()) + "\n", encoding="utf-8")
        for name in PACKAGES:
            shutil.copytree(_ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__"))
    except OSError as error:
        reason = error.strerror or "some files could not be copied"
        raise InputError(
            f"--out {folder}: cannot be written ({reason}); give a folder that does not exist yet"
        ) from None
    print(
        f"{folder} is written. Zip its content, not the folder itself, and upload the file to Gradescope:\n"
        f"  cd {folder} && zip -r ../autograder.zip ."
    )
    return 0


def requirements() -> list[str]:
    """Returns the packages that himpc-lab needs, with the versions that are installed here."""
    found: dict[str, str] = {}
    left = ["himpc-lab"]
    while left:
        name = left.pop()
        try:
            installed = distribution(name)
        except PackageNotFoundError:  # needed on another system
            continue
        if name != "himpc-lab":
            found[name] = installed.version
        wanted = [each for each in installed.requires or () if "extra ==" not in each]
        names = {re.split(r"[^\w.-]", each, maxsplit=1)[0].lower().replace("_", "-") for each in wanted}
        left += sorted(names - found.keys() - {"himpc-lab"})
    if not found:
        raise InputError(
            f"{sys.executable} does not know the packages of himpc-lab: install himpc-lab with pip first"
        )
    return [f"{name}=={version}" for name, version in sorted(found.items())]
