"""`himpc-lab new`."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro


def new(
    kind: tyro.conf.Positional[Literal["controller", "scene", "lesson", "task", "exercise"]],
    file: tyro.conf.Positional[str],
    start: Annotated[str | None, tyro.conf.arg(name="from", metavar="NAME")] = None,
) -> int:
    """Write a short file that runs and that you can change: Python, or Markdown for a lesson.

    Args:
        kind: the kind of file.
        file: path of the new file.
        start: copy an existing file instead of the template: an example controller (pd, osf, one_level_qp,
            himpc_one_page), a scene, a lesson, a kind of task (com, plane_distance, …), or the file with
            which students begin an exercise (give its name, see himpc-lab grade, or the path of your own
            exercise).
    """
    from lessons.authoring.new import write_new
    from lessons.exercises import EXERCISES
    from lessons.exercises.own import any_exercise
    from lessons.own.files import is_file

    write_new(kind, file, start)
    exercise = any_exercise(start) if start in EXERCISES or (start is not None and is_file(start)) else None
    if exercise is not None and start is not None and exercise.start:
        lines = (f"himpc-lab grade {file} {start}",)
    elif exercise is not None:
        settings = "".join(f" --set {each}" for each in exercise.live)
        run = f"himpc-lab run {exercise.scene} --controller {file}{settings}"
        lines = (run, *exercise.commands(file)[1:])
    else:
        own = f"planar3-circle --controller {file}" if kind == "controller" else file
        lines = {
            "lesson": (f"himpc-lab lessons --check {file}", f"himpc-lab --lesson {file}"),
            "exercise": (
                f"himpc-lab grade --check {file}",
                f"himpc-lab new controller start.py --from {file}",
                f"himpc-lab grade start.py {file}",
            ),
        }.get(kind, (f"himpc-lab run {own}", f"himpc-lab --scene {own}"))
    print("\n  ".join((f"{file} is written. Try it:", *lines)))
    return 0
