"""Writes a template file for a controller, scene, task, lesson or exercise."""

from __future__ import annotations

import os
from collections.abc import Sequence
from importlib.resources import files
from pathlib import Path
from typing import Literal

from himpc.tasks import KINDS
from lessons.course import COURSE, lesson_file
from lessons.exercises import EXERCISES, start_of
from lessons.exercises.own import exercise_in
from lessons.outputs import write_files
from lessons.own.files import LESSON_SUFFIX, SUFFIX, is_file
from lessons.own.kinds import Kind as PythonKind
from lessons.scenes.names import ALL_SCENES
from robots import InputError
from robots.errors import unknown_name

Kind = PythonKind | Literal["lesson"]

EXAMPLES: tuple[str, ...] = ("pd", "osf", "one_level_qp", "himpc_one_page")
"""Controllers that can be used as a template."""
TASKS: tuple[str, ...] = (
    "position",
    "orientation",
    "com",
    "relative_position",
    "relative_orientation",
    "plane_distance",
)
"""Kinds of tasks that can be used as a template. Two kinds are left out. Tasks on joints have little to
change. The target of a task in a file must be a value of the task's coordinates, which is not true of a
pointing task."""


def choices(kind: Kind) -> Sequence[str]:
    """Returns the templates of a kind of file."""
    controllers = (*EXAMPLES, *EXERCISES)
    return {
        "controller": controllers,
        "scene": tuple(ALL_SCENES),
        "lesson": COURSE,
        "task": TASKS,
        "exercise": (),
    }[kind]


def text_of(kind: Kind, start: str | None, file: str) -> str:
    """Returns the text of a new file. Raises InputError if there is no such template."""
    known = choices(kind)
    if kind == "controller" and start is not None and is_file(start):
        return exercise_in(start).start
    if kind == "exercise" and start is not None:
        raise InputError("an exercise has one template: leave out --from")
    if start is not None and start not in known:
        raise unknown_name(f"template of a {kind}", start, known)
    if kind == "controller" and start in EXERCISES:
        text = start_of(start)
    elif kind == "controller":
        package, name = ("himpc", "printed") if start == "himpc_one_page" else ("lessons.examples", start)
        text = _read(package, name or EXAMPLES[0])
    elif kind == "lesson" and start is not None:
        text = lesson_file(start).read_text(encoding="utf-8")
    elif kind == "scene" and start is not None:
        text = _SCENE.format(scene=start)
    elif kind == "task" and start is not None:
        text = _task(start)
    else:
        text = _read("lessons.authoring.begin", kind, LESSON_SUFFIX if kind == "lesson" else SUFFIX)
    return text.replace("FILE.py", file)


def write_new(kind: Kind, path: str, start: str | None = None) -> None:
    """Writes a new file. Raises InputError if the file exists already or cannot be written."""
    suffix = LESSON_SUFFIX if kind == "lesson" else SUFFIX
    if not path.endswith(suffix):
        raise InputError(f"{path}: give a name that ends with {suffix}, e.g. my_{kind}{suffix}")
    text = text_of(kind, start, path)
    if os.path.lexists(path):
        raise InputError(f"{path} exists already: give another name, or remove it first")
    try:
        write_files({path: text})
    except OSError as error:
        raise InputError(f"{path} cannot be written ({error.strerror}): give another path") from None


def _read(package: str, name: str, suffix: str = SUFFIX) -> str:
    return Path(str(files(package) / f"{name}{suffix}")).read_text(encoding="utf-8")


def _task(word: str) -> str:
    """Returns the text of a task file: the source code of one of the lab's kinds of tasks, followed by one
    task of that kind."""
    of = KINDS[word].makes[0]
    package, _, module = of.__module__.rpartition(".")
    says, rest = _read(package, module).split('"""\n', 1)
    return (
        f'{says}\n\n    himpc-lab run FILE.py\n\nThe lab\'s own kind "{word}", to be changed.\n"""\n{rest}\n'
        "\n"
        f'TASK = {of.__name__}(name="my_{word}", K_p=100.0, K_v=20.0)\n'
    )


_SCENE = '''"""The scene {scene}, to be changed.

    himpc-lab run FILE.py
    himpc-lab --scene FILE.py
"""

from dataclasses import replace

from lessons import load_scene

START = load_scene("{scene}")

# Every field of a scene may be replaced: settings (any path of himpc-lab run --set), q_0, events, duration, …
SCENE = replace(START, title="{scene}, changed", settings=START.settings.changed("horizon", 10))
'''
