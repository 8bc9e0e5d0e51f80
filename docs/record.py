"""Runs every step of every lesson once and stores the site's curves: `python -m docs.record [NAME …]`.

docs/site/recorded/NAME.json contains the plotted curves of each step, for the run and for its ghost. It also
contains the robot's motion in one step of the lesson. The page shows the motion of the first lesson while the
controllers are compiled (app/view/recorded.json).
"""

from __future__ import annotations

import argparse
import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from app.worker.lecturer import thinned
from lessons.course import COURSE, load_lesson
from lessons.recording.run import Recording, run
from lessons.teaching.lesson import Lesson, Step

ROOT = Path(__file__).parents[1]
FOLDER, OPENING = ROOT / "docs" / "site" / "recorded", ROOT / "app" / "view" / "recorded.json"
RATE = 25.0
"""The largest number of stored configurations per second of a motion."""
PLAYED = {"a-redundant-arm": 1, "no-model-needed": 1, "one-task": 1, "swap-the-priorities": 2, "two-tasks": 1}
"""For some lessons, the place of the step whose motion is stored. For the other lessons it is the first
step."""

Array = NDArray[np.float64]


def recorded(lesson: Lesson) -> dict[str, Any]:
    """Returns the stored data of a lesson."""
    steps, played = [], PLAYED.get(lesson.name, 0)
    motion: dict[str, Any] = {}
    for place, step in enumerate(lesson.steps):
        runs = runs_of(lesson, step)
        steps.append({"title": step.title, "plots": [plot(step, k, runs) for k in range(len(step.plots))]})
        if place == played:
            motion = {"step": place, **moved(lesson, step, runs)}
    return {"steps": steps, "motion": motion}


def runs_of(lesson: Lesson, step: Step) -> list[Recording]:
    """Returns the step's run and, if there is a ghost, the ghost's run."""
    own = lesson.run_of(step)
    wanted = [own] if step.ghost is None else [own, own.but(*step.ghost.set)]
    return [run(each.prepared(), to_the_end=True) for each in wanted]


def plot(step: Step, place: int, runs: list[Recording]) -> dict[str, Any]:
    """Returns one signal: its times and values for each run."""
    signal = step.plots[place]
    drawn = [thinned(each["t"][:, 0], signal.over(each)) for each in runs]
    return {
        "words": signal.words,
        "unit": signal.unit,
        "t": [rounded(t) for t, _ in drawn],
        "curves": [rounded(y) for _, y in drawn],
    }


def moved(lesson: Lesson, step: Step, runs: list[Recording]) -> dict[str, Any]:
    """Returns the motion of the joints and of the targets: period in s, joint angles of each run, targets by
    task."""
    own = runs[0]
    T_s = own.session.settings.T_s
    every = max(1, round(1.0 / (RATE * T_s)))
    targets = {}
    for task in own.layout.tasks:
        x_d = own[f"x_d/{task.name}"]
        if task.unit == "m" and x_d.shape[1] in (2, 3) and np.isfinite(x_d).any():
            targets[task.name] = rounded(x_d[::every], 4)
    return {
        "period": every * T_s,
        "words": [step.title, *([step.ghost.words] if step.ghost else [])],
        "q": [rounded(each["q"][::every], 4) for each in runs],
        "targets": targets,
    }


def rounded(values: Array, digits: int | None = None) -> list[Any]:
    """Returns values for JSON: rounded to four significant digits, or to `digits` decimals; None for NaN and
    infinities."""
    if values.ndim > 1:
        return [rounded(row, digits) for row in values]
    return [
        None if not np.isfinite(v) else float(f"{v:.4g}") if digits is None else round(float(v), digits)
        for v in values
    ]


def write(name: str, folder: Path = FOLDER) -> Path:
    """Runs one lesson and writes its file."""
    folder.mkdir(parents=True, exist_ok=True)
    path = folder / f"{name}.json"
    told = json.dumps(recorded(load_lesson(name)), ensure_ascii=False, separators=(",", ":"))
    path.write_text(
        told.replace(',{"title"', ',\n{"title"').replace('"motion"', '\n"motion"') + "\n", "utf-8"
    )
    return path


def opening(path: Path) -> dict[str, Any]:
    """Returns what a page shows of the recorded lesson: the robot, its motion, and the period in s."""
    motion = json.loads(path.read_text("utf-8"))["motion"]
    lesson = load_lesson(path.stem)
    robot = lesson.run_of(lesson.steps[motion["step"]]).scene.partition("-")[0]
    return {"robot": robot, "period": motion["period"], "q": motion["q"][0]}


def main() -> None:
    """Records the lessons that the command line names."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("names", nargs="*", default=list(COURSE))
    for name in parser.parse_args().names:
        path = write(name)
        if name == COURSE[0]:
            OPENING.write_text(json.dumps(opening(path)) + "\n", "utf-8")
        print(f"{name}: {path.stat().st_size / 1000:.0f} kB", file=sys.stderr, flush=True)


if __name__ == "__main__":
    main()
