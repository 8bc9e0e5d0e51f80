"""The steps of lessons that a browser can run, with prediction and claims."""

from __future__ import annotations

from dataclasses import asdict
from functools import cache
from html import escape
from typing import Any

from app.html.text import readable
from docs.figures.pack import Pack
from docs.figures.scene import refuse, scene_data
from lessons.course import load_lesson
from lessons.scenes.run_spec import RunSpec
from lessons.scenes.scene import Scene, TorqueScene
from lessons.settings.assignments import differences
from lessons.teaching.lesson import Claim, Lesson, Step
from lessons.teaching.measure import UNITS, Measure, Signal
from lessons.teaching.prediction import Choice, Prediction, Value
from robots import InputError

FIELDS = ("t", "q", "v", "tau", "tau_demand", "tau_lower", "tau_upper", "v_limit", "q_lower", "q_upper")
FIELDS += (
    "at_bound",
    "delta_tau",
    "tau_0",
    "priority_leak",
    "gauge_norm",
    "gauge_radius",
    "unsolved",
    "late",
    "contact_force",
)
"""Fields of telemetry that a browser has. It also has error/TASK, active/LEVEL and, for positions and joints,
x/TASK."""
_DERIVED = (
    "torque share",
    "speed share",
    "position share",
    "deceleration to stop",
    "speed within 5° of an end",
)
_DERIVED += (
    "at a torque bound",
    "at a speed bound",
    "at a position bound",
    "joints moved",
    "distance from the start",
)


@cache
def _bare(scene: str, urdf: str | None) -> Scene:
    """Returns the scene without assignments. It is cached: importing a robot from a file takes a second."""
    return RunSpec(scene, urdf).loaded()


@cache
def _prepared(run: RunSpec) -> Scene:
    return run.prepared(_bare(run.scene, run.urdf))


@cache
def why_not(name: str, place: int) -> str | None:
    """Returns the reason why a step (0 is the first) has no live figure; None if the step has a live
    figure."""
    lesson = load_lesson(name)
    try:
        refuse(_scene_of(lesson.run_of(lesson.steps[place])))
    except InputError as error:
        return str(error)
    return None


def told_settings(lesson: Lesson, step: Step) -> list[str]:
    """Returns the assignments that turn the settings of the lesson's scene into those of a step, as in a
    state code."""
    run = lesson.run_of(step)
    return list(differences(_bare(run.scene, run.urdf).settings, _prepared(run).settings))


def robot_of(lesson: Lesson, step: Step) -> str:
    """Returns the page's name for the robot of a step."""
    return scene_of_step(lesson, step).robot.name


def scene_of_step(lesson: Lesson, step: Step) -> Scene:
    """Returns the prepared scene of a step."""
    return _prepared(lesson.run_of(step))


def lesson_script(lesson: Lesson) -> str | None:
    """Returns the script that gives the live steps of a lesson to the page; None if it has no live steps."""
    pack = Pack()
    steps = {
        str(place + 1): _step(lesson, place, pack)
        for place in range(len(lesson.steps))
        if why_not(lesson.name, place) is None
    }
    return pack.script(f"lesson/{lesson.name}", {"steps": steps}) if steps else None


def robots_of(lesson: Lesson) -> dict[str, Any]:
    """Returns the robots of the live steps by the page's names for them."""
    return {
        scene.robot.name: scene.robot
        for place, step in enumerate(lesson.steps)
        if why_not(lesson.name, place) is None
        for scene in [_prepared(lesson.run_of(step))]
    }


def _scene_of(run: RunSpec) -> TorqueScene:
    scene = _prepared(run)
    if not isinstance(scene, TorqueScene):
        raise InputError("HTMPC runs at velocity level; its solver is not exported")
    return scene


def _step(lesson: Lesson, place: int, pack: Pack) -> dict[str, Any]:
    step = lesson.steps[place]
    run, ghost, ghost_missing = lesson.run_of(step), None, None
    if step.ghost is not None:
        try:
            ghost = scene_data(_scene_of(run.but(*step.ghost.set)), pack)
        except InputError as error:
            ghost_missing = str(error)
    return {
        "state": {"s": run.scene, "l": lesson.name, "p": place + 1}
        | ({"r": lesson.urdf} if lesson.urdf else {}),
        "set": told_settings(lesson, step),
        "scene": scene_data(_scene_of(run), pack),
        "ghost": ghost,
        "ghost_told": _ghost_told(step, ghost_missing),
        "ghost_set": [each.partition("=")[0] for each in step.ghost.set] if step.ghost else [],
        "claims": [_claim(claim, ghost is not None) for claim in step.claims],
        "prediction": _prediction(step.prediction, ghost is not None),
        "asking": _asking(f"{lesson.name}-{place + 1}", step, ghost is not None),
    }


def _ghost_told(step: Step, missing: str | None) -> str:
    if step.ghost is None:
        return ""
    return (
        f"The ghost ({step.ghost.words}) runs in himpc-lab only: {missing}. "
        if missing
        else f"Violet: the ghost, {step.ghost.words}. "
    )


def _asking(name: str, step: Step, with_ghost: bool) -> str:
    """Returns the question of the prediction and the list of claims as HTML; `name`: the name of the radio
    buttons."""
    claims = "".join(
        f"<li>{escape(claim.text)}{'' if judged(claim.measure, with_ghost) else _NOT_HERE}</li>"
        for claim in step.claims
    )
    question = _question(name, step.prediction) if _prediction(step.prediction, with_ghost) else ""
    return f'{question}<ul class="hl-claims">{claims}</ul>'


_NOT_HERE = " (judged in himpc-lab only)"


def _question(name: str, asked: Prediction | None) -> str:
    if isinstance(asked, Choice):
        inputs = "".join(
            f'<label class="hl-check"><input type="radio" name="{name}" value="{k}">'
            f"{escape(each.text)}</label>"
            for k, each in enumerate(asked.options)
        )
    elif isinstance(asked, Value):
        given = f'<input type="number" min="{asked.low}" max="{asked.high}" step="any">'
        inputs = f"<label>{given} {escape(asked.measure.unit)}</label>"
    else:
        return ""
    box = f"<legend>{escape(asked.question)}</legend>{inputs}"
    return f'<fieldset class="hl-guess">{box}</fieldset><p class="hl-answer"></p>'


def judged(measure: Measure, with_ghost: bool) -> bool:
    """Returns whether a browser can measure the claim."""
    name, _, of = measure.signal.name.partition("/")
    known = (
        name in FIELDS or measure.signal.name in _DERIVED or (bool(of) and name in ("error", "x", "active"))
    )
    return known and (with_ghost or not measure.over_ghost)


def _claim(claim: Claim, with_ghost: bool) -> dict[str, Any]:
    return {
        "text": claim.text,
        "measure": _measure(claim.measure),
        "relation": claim.relation,
        "bound": claim.bound,
        "condition": readable(claim.condition),
        "live": judged(claim.measure, with_ghost),
    }


def _measure(measure: Measure) -> dict[str, Any]:
    until = measure.until if measure.until < float("inf") else None
    return {
        "signal": _signal(measure.signal),
        "statistic": measure.statistic,
        "after": measure.after,
        "until": until,
        "over_ghost": measure.over_ghost,
        "unit": measure.unit.replace("deg", "°"),
    }


def _signal(signal: Signal) -> dict[str, Any]:
    return asdict(signal) | {"factor": UNITS[signal.unit], "words": signal.words}


def _prediction(prediction: Prediction | None, with_ghost: bool) -> dict[str, Any] | None:
    if prediction is None or not judged(prediction.measure, with_ghost):
        return None
    told: dict[str, Any] = {"measure": _measure(prediction.measure)}
    if isinstance(prediction, Choice):
        options = prediction.options
        return told | {
            "options": [
                {"text": each.text, "low": _end(each.low), "high": _end(each.high)} for each in options
            ]
        }
    return told if isinstance(prediction, Value) else None


def _end(value: float) -> float | None:
    return value if abs(value) < float("inf") else None
