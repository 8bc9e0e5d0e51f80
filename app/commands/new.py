"""`himpc-lab new`."""

from __future__ import annotations

from typing import Annotated, Literal

import tyro


def new(
    kind: tyro.conf.Positional[Literal["controller", "scene", "lesson", "task"]],
    file: tyro.conf.Positional[str],
    start: Annotated[str | None, tyro.conf.arg(name="from", metavar="NAME")] = None,
) -> int:
    """Write a short, commented Python file that already runs, to be changed.

    Args:
        kind: what the file is to be.
        file: where to write it.
        start: begin with one there is: an example controller (pd, osf, one_level_qp, himpc_one_page) or the
            file of an exercise (himpc-lab grade lists them), a scene, or a lesson.
    """
    from lessons.own.new import write_new

    write_new(kind, file, start)
    tries = {
        "controller": f"himpc-lab run planar3-circle --controller {file}",
        "scene": f"himpc-lab run {file}",
        "lesson": f"himpc-lab lessons --check {file}",
        "task": f"himpc-lab run {file}",
    }
    shows = {
        "controller": f"himpc-lab --scene planar3-circle --controller {file}",
        "scene": f"himpc-lab --scene {file}",
        "lesson": f"himpc-lab --lesson {file}",
        "task": f"himpc-lab --scene {file}",
    }
    print(f"{file} is written. Try it:\n  {tries[kind]}\n  {shows[kind]}")
    return 0
