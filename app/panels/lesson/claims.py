"""The HTML of a lesson's tab: the heading, the idea, the state of the claims, and the explanation."""

from __future__ import annotations

import math
from collections.abc import Sequence

from app.html.markdown import STYLE, rendered, rendered_line, split, word_count
from app.html.palette import BAD, BOUND, GHOST, GOOD, LEVELS, RGB, css, ink, on
from app.html.text import badge, bar, block, esc, figure, joints_named, readable
from app.link.exercise import Lecture, LessonPlace, parts_of, signals_of
from app.panels.lesson.drawing import TRUTH, Bound, Line, chart
from lessons.course import COURSE
from lessons.events import Appear, InsertTask, MoveLevel, MoveTarget, Push, Release, RemoveTask, Reset, Set
from lessons.teaching.lesson import Challenge, Claim, Script, Step
from lessons.teaching.measure import Signal
from lessons.teaching.prediction import Choice

Part = Step | Challenge


def heading(exercise: LessonPlace) -> str:
    """Returns the heading: the lesson, the number of the step and the number of steps."""
    lesson = exercise.whole
    parts = parts_of(lesson)
    names = [part.title if isinstance(part, Step) else "Challenge" for part in parts]
    dots = " ".join(
        f'<span title="{esc(name)}" style="opacity:{1 if k == exercise.place else 0.45}">'
        f"{'●' if k == exercise.place else '○'}</span>"
        for k, name in enumerate(names)
    )
    number = f"Lesson {COURSE.index(lesson.name) + 1}" if lesson.name in COURSE else "A lesson of your own"
    title = f"{number}: {esc(lesson.card.title)}"
    return STYLE + block(
        f'<div style="opacity:0.8">{title} &nbsp;{dots} &nbsp;{exercise.place + 1} of {len(parts)}</div>'
        f'<div style="font-size:1.25em;font-weight:700;margin-top:0.15em">{esc(names[exercise.place])}</div>',
        "padding-top:0.5em",
    )


_BEFORE, _AFTER, _WHY, _SLIDERS = 64, 104, 60, 10
"""Words of a step's own texts that are in view before and after its run, at most those of its reason, and
those of the sliders of a guess. The page's other words are the names of tabs and buttons."""


def idea(part: Part, opened: bool) -> str:
    """Returns the text of the idea. Before the run it shows the sentences for which there is room, and the
    rest on request; after the run all of it on request, so that the results come first."""
    words, ghost = part.text, part.ghost if isinstance(part, Step) else None
    beside = "" if ghost is None else f'<p style="opacity:0.8">Ghost, dashed: <b>{esc(ghost.words)}</b></p>'
    if isinstance(part, Challenge) or not opened:
        title = "The task" if isinstance(part, Challenge) else "The idea"
        shown = " open" if opened else ""
        return block(f"<details{shown}><summary><b>{title}</b></summary>{rendered(words)}{beside}</details>")
    first, rest = split(
        words, _BEFORE - _asked_words(part) - word_count("" if ghost is None else ghost.words)
    )
    return block(rendered(first) + beside + _more(rest))


def _asked_words(part: Step, shown: int | None = None) -> int:
    """Returns the number of words of the question and its answers; `shown`: how many options, the longest
    ones, are counted."""
    prediction = part.prediction
    if prediction is None:
        return 0
    options = prediction.options if isinstance(prediction, Choice) else ()
    counts = sorted((word_count(option.text) for option in options), reverse=True)
    return word_count(prediction.question) + (sum(counts[:shown]) if options else _SLIDERS)


def _result_words(part: Step) -> int:
    """Returns the number of words that stand beside the reason: the question, its answers, the first claim,
    the knobs and the curves."""
    told = [part.do, *(control.words for control in part.controls), *(plot.words for plot in part.plots)]
    told += [claim.text for claim in part.claims[:1]] + ([part.ghost.words] if part.ghost else [])
    return _asked_words(part, 2) + sum(map(word_count, told))


def _more(rest: str) -> str:
    return f"<details><summary>More</summary>{rendered(rest)}</details>" if rest else ""


def state(part: Part, lecture: Lecture, best: float | None) -> str:
    """Returns the progress of the run, the claims or goals, the curves, and a challenge's points."""
    challenge = isinstance(part, Challenge)
    claims = part.goals if isinstance(part, Challenge) else part.claims
    html = "" if lecture.phase == "waiting" and not challenge else _progress(lecture)
    if challenge:
        html += block(f"<b>Goals</b>{''.join(_claim(c, k, lecture) for k, c in enumerate(claims))}")
    elif lecture.attempt:
        html += block(_claims(claims, lecture))
    if isinstance(part, Challenge):
        html += _points(part, lecture, best)
    return html


def why(part: Part) -> str:
    if isinstance(part, Challenge):
        return ""
    first, rest = split(part.why, min(_WHY, _AFTER - _result_words(part)))
    return block(
        f"<b>Why</b>{rendered(first)}{_more(rest)}", f"border-left:3px solid {css(LEVELS[2])};margin:0.3em 0"
    )


def now_you(part: Part, lecture: Lecture) -> str:
    if isinstance(part, Challenge):
        return ""
    return block(f"<b>Now you:</b> {rendered_line(part.do)}")


def _progress(lecture: Lecture) -> str:
    share = lecture.t / lecture.duration
    match lecture.phase:
        case "waiting":
            words = "Choose the settings, then start the run."
        case "preparing":
            words = "The run starts when the ghost has been computed."
        case "running":
            words = (
                f"{badge('RUNNING', GOOD)} {lecture.t:.2f} of {lecture.duration:g} s, judged during the run"
            )
        case "done":
            words = f'<span title="judged on the first {lecture.t:.3g} s">{badge("DONE", LEVELS[1])}</span>'
    if lecture.lost_at is not None:
        words += f"<br>{badge('LOST', BAD)} Out of control at {lecture.lost_at:.2f} s."
    if lecture.changed:
        words += f"<br><i>{esc(lecture.changed)}</i>"
    return block(words + ("" if lecture.phase == "done" else bar(share, LEVELS[1])))


_SIGNS: dict[bool | None, tuple[str, str, RGB]] = {
    True: ("✓", "true", GOOD),
    False: ("✗", "false", BAD),
    None: ("…", "nothing to measure yet", BOUND),
}


def _claims(claims: Sequence[Claim], lecture: Lecture) -> str:
    """Returns the first claim in words, and of the others the verdicts, with their words on request."""
    first, *others = (_claim(claim, k, lecture) for k, claim in enumerate(claims))
    if not others:
        return first
    verdicts = " ".join(_judged(k, lecture)[0] for k in range(1, len(claims)))
    missed = " open" if lecture.phase == "done" and False in lecture.holds[1:] else ""
    results = "1 more result" if len(others) == 1 else f"{len(others)} more results"
    return f"{first}<details{missed}><summary>{results}: {verdicts}</summary>{''.join(others)}</details>"


def _judged(place: int, lecture: Lecture) -> tuple[str, str, RGB]:
    """Returns the sign, the word and the colour of a claim."""
    holds = lecture.holds[place] if place < len(lecture.holds) else None
    if lecture.phase == "running" and holds is not None:  # more of the run may turn it around
        return "…", "so far", BOUND
    return _SIGNS[holds]


def _figure(claim: Claim, place: int, lecture: Lecture) -> str:
    value = lecture.values[place] if place < len(lecture.values) else math.nan
    return figure(value, claim.measure.unit)


def _claim(claim: Claim, place: int, lecture: Lecture) -> str:
    sign, word, colour = _judged(place, lecture)
    wanted = f"must be {readable(claim.condition)}"
    value = _figure(claim, place, lecture)
    measured = {"true": f"<b>{value}</b>", "nothing to measure yet": f"<b>{word}</b>"}.get(
        word, f'<b style="color:{ink(colour)}">{word}</b> {value}, {wanted}'
    )
    return (
        f'<div style="display:flex;gap:0.5em;margin:0.25em 0"><div style="flex:0 0 1.3em;height:1.3em;'
        f"border-radius:50%;text-align:center;font-weight:700;color:{css(on(colour))};"
        f'line-height:1.3;background:{css(colour)}">'
        f'{sign}</div><div style="min-width:0" title="{esc(claim.measure.words)}: {wanted}">'
        f"{esc(claim.text)} {measured}</div></div>"
    )


def _points(challenge: Challenge, lecture: Lecture, best: float | None) -> str:
    html = ""
    if lecture.result is not None:
        if not lecture.result.passed:
            html = f"{badge('NOT YET', BAD)} A goal is missed: change a knob and start again."
        elif lecture.changed:
            html = f"{badge('DOES NOT COUNT', BAD)} Reset this challenge and try again."
        else:
            html = (
                f"{badge('PASSED', GOOD)} <b>{lecture.result.score:.0f} points</b> of 100. The points depend "
                f"on this value: {esc(challenge.score.measure.words)}. It is "
                f"{figure(lecture.points_for, challenge.score.measure.unit)}; with "
                f"{figure(challenge.score.best, challenge.score.measure.unit)} you get 100 points."
            )
    if best is not None:
        html += f"<div>Your best score: <b>{best:.0f}</b></div>"
    return block(html) if html else ""


def pictures(part: Part, lecture: Lecture) -> str:
    """Returns the signals of the step, plotted over the run: the predicted one first, and large. They stand
    below each other in a narrow panel, and beside each other in a wide one."""
    if not lecture.curves:
        return block("No run yet.")
    claims = part.goals if isinstance(part, Challenge) else part.claims
    ghost = part.ghost.words if isinstance(part, Step) and part.ghost is not None else ""
    signals = signals_of(part)
    asked = part.prediction.measure.signal if isinstance(part, Step) and part.prediction is not None else None
    marks = _happenings(part.events)
    drawn = ""
    for k in sorted(range(len(signals)), key=lambda k: signals[k] != asked):
        own = lecture.curves[k]
        beside = lecture.ghosts[k] if k < len(lecture.ghosts) and len(lecture.ghosts[k].t) else None
        named = beside is not None and not drawn  # the first chart names the curves
        lines = [Line("robot" if named else "", TRUTH, own)]
        if beside is not None:
            lines.append(Line(f"ghost: {ghost}" if named else "", GHOST, beside, "5 4"))
        drawing = chart(
            joints_named(signals[k].words),
            _unit(signals[k]),
            lines,
            _bounds(claims, signals[k]),
            [(t, "" if drawn else words) for t, words in marks],  # the first chart says what happens
            part.duration,
            _SMALL if drawn else _LARGE,
            lecture.phase == "done",
        )
        size = _BESIDE if drawn else _FIRST
        drawn += f'<div style="{size}">{drawing}</div>' if drawing else ""
    return block(drawn, "display:flex;flex-wrap:wrap;gap:0 1em")


_LARGE, _SMALL = 220, 140
_FIRST, _BESIDE = "flex:0 1 27em", "flex:1 1 200px;max-width:24em"
_WORDS: dict[type, str] = {
    MoveTarget: "target moves",
    Push: "push",
    Set: "setting changes",
    MoveLevel: "order changes",
    Release: "release",
    InsertTask: "new task",
    RemoveTask: "task removed",
    Appear: "obstacle appears",
    Reset: "reset",
}


def _happenings(script: Script) -> list[tuple[float, str]]:
    """Returns the times of a script, s, with what happens."""
    found: dict[float, list[str]] = {}
    for t, event in script:
        found.setdefault(t, []).append(_WORDS[type(event)])
    return [(t, ", ".join(dict.fromkeys(words))) for t, words in found.items()]


def _unit(signal: Signal) -> str:
    return "°" if signal.unit == "deg" else signal.unit


def _bounds(claims: tuple[Claim, ...], signal: Signal) -> list[Bound]:
    """Returns the bounds in claims about the largest or the last value of the signal itself. Of two bounds
    that hold in the same part of the run, the stricter one is drawn."""
    bounds: dict[tuple[str, float, float], Bound] = {}
    for claim in claims:
        measure, least = claim.measure, claim.relation == "at least"
        if measure.signal != signal or measure.over_ghost or measure.statistic not in ("largest", "last"):
            continue
        bound = Bound(claim.bound, readable(claim.condition), claim.text, measure.after, measure.until)
        drawn = bounds.setdefault((claim.relation, bound.after, bound.until), bound)
        if (bound.value > drawn.value) == least:
            bounds[claim.relation, bound.after, bound.until] = bound
    return list(bounds.values())
