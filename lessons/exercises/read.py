"""Reads an exercise of the lab from its file, NAME.toml: the card, the runs, the checks and the mistakes."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from functools import cache, partial
from pathlib import Path
from typing import Any

from lessons.exercises.exercise import Exercise, GradeCheck, pushed, with_gains
from lessons.exercises.laws import LAWS
from lessons.exercises.mistakes import Mistake
from lessons.scenes.run_spec import RunSpec
from lessons.teaching.lesson import Card
from lessons.teaching.reader import read_event, read_test

SAME = 1e-6
"""N·m: a torque that differs by less from that of a controller counts as the same."""
_OWN_LAW = "the law of the exercise"


@cache
def read_exercise(name: str) -> Exercise:
    """Returns the exercise with this name.

    In its file, `set` above the runs holds for all of them. A check needs either `is`, a measure with its
    bound as in a lesson, or `torque_of`, the controller whose torque the submission must return. `gains` and
    `push` disturb its run, see `with_gains` and `pushed`; their `seed` is added to the seed of the grading.
    A mistake is a sentence with the arguments of the law (`lessons.exercises.laws`), or with another law.
    """
    path = Path(__file__).with_name(f"{name.replace('-', '_')}.toml")
    data = tomllib.loads(path.read_text(encoding="utf-8"))
    return Exercise(
        name,
        Card(data["title"], data["question"], data["minutes"], data["needs"]),
        data["equation"],
        data["plain"],
        tuple(data["hints"]),
        data["lesson"],
        partial(_checks, name, str(path), data),
        tuple(_mistake(name, says, **how) for says, how in data["mistakes"]),
        live=tuple(data.get("live", ())),
    )


def _mistake(name: str, says: str, *, law: str = "", **how: Any) -> Mistake:
    return Mistake(says, partial(LAWS[law or name], **how))


def _checks(name: str, path: str, data: Mapping[str, Any], seed: int) -> tuple[GradeCheck, ...]:
    runs = {key: _run(path, data.get("set", ()), **run) for key, run in data["run"].items()}
    return tuple(_check(name, path, runs[check["run"]], check, seed) for check in data["check"])


def _run(
    path: str, common: list[str], scene: str, seconds: float, set: tuple[str, ...] = (), events: Any = ()
) -> RunSpec:
    script = tuple((float(t), read_event(path, words)) for t, words in events)
    return RunSpec(scene, set=(*common, *set), events=script or None, duration=float(seconds))


def _check(name: str, path: str, run: RunSpec, data: Mapping[str, Any], seed: int) -> GradeCheck:
    if "gains" in data:
        levels, more, gains = _with_seed(data["gains"], "levels", seed)
        run = with_gains(run, more, *levels, **gains)
    if "push" in data:
        body, more, push = _with_seed(data["push"], "body", seed)
        run = pushed(run, more, body, **push)
    text, why, points = data["text"], data["why"], data["points"]
    if "is" in data:
        test = read_test(path, data["is"])
        return GradeCheck(text, why, run, test.bound, test.relation, test.measure, points=points)
    controller = LAWS[name]() if data["torque_of"] == _OWN_LAW else data["torque_of"]
    return GradeCheck(text, why, run, SAME, beside=controller, points=points)


def _with_seed(data: Mapping[str, Any], key: str, seed: int) -> tuple[Any, int, dict[str, Any]]:
    """Returns the value of a key, the seed, and all other values."""
    more = dict(data)
    return more.pop(key), seed + more.pop("seed", 0), more
