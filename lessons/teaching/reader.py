"""Reads a lesson from Markdown, and names file, line and column of what it cannot use.

A line `- key: value` is an item. Items indented below it belong to it, and an indented line without a dash
continues its value. All other lines are texts. A mark `[^label]` in a text belongs to a note `[^label]: …` of
the same step, which says what allows the words before the mark. Nothing in a lesson is executed: events and
notes are closed lists of words. docs/authoring.md describes the format.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import MISSING, dataclass, field, fields, replace
from pathlib import Path
from typing import Any, get_args

from lessons import events
from lessons.settings.assignments import parse_assignment
from lessons.teaching.lesson import Card, Challenge, Claim, Control, Ghost, Lesson, Note, Score, Step
from lessons.teaching.measure import Measure, Signal, Statistic
from lessons.teaching.prediction import Choice, Option, Prediction, Sketch, Value
from robots import InputError
from robots.errors import shortened, unknown_name

_KEYS: dict[str, tuple[str, ...]] = {
    "lesson": ("minutes", "needs", "scene", "robot", "set"),
    "step": ("set", "run", "ghost", "control", "plot", "predict", "claim"),
    "challenge": ("set", "run", "control", "goal", "score", "solution"),
    "run": ("at",),
    "ghost": ("set",),
    "predict": ("measure", "option", "tempting", "number", "signal", "draw"),
    "claim": ("is", "fails with", "because"),
    "goal": ("is",),
    "solution": ("set",),
}
"""The keys of each part of a lesson, and those of the items below an item."""

EVENTS = {
    "set": events.Set,
    "move level": events.MoveLevel,
    "move target": events.MoveTarget,
    "push": events.Push,
    "reset": events.Reset,
    "release": events.Release,
    "insert task": events.InsertTask,
    "remove task": events.RemoveTask,
    "appear": events.Appear,
}
"""The events by their words."""

_NUMBER = r"[-+]?(?:\d+\.?\d*|\.\d+)(?:e[-+]?\d+)?"
_SIGNAL = r"(?P<name>[^\[(]+?)(?:\[(?P<column>\d+)\])?(?: \((?P<unit>[^)]*)\))?"
_MEASURE = (
    rf"(?:(?P<statistic>{'|'.join(get_args(Statistic))}) of )?{_SIGNAL}"
    r"(?: after (?P<after>#) s)?(?: until (?P<until>#) s)?(?P<over_ghost> over ghost)?"
)
_SETTINGS = "`[^`]+`(?:, `[^`]+`)*"
_FORMS: dict[str, tuple[str, str]] = {
    "minutes": ("(?P<minutes>#)", "8"),
    "run": ("(?P<duration>#) s", "2.2 s"),
    "at": ("(?P<time>#) s", "at 0.5 s"),
    "plot": (_SIGNAL, "error/position (mm)' or 'q[2] (deg)"),
    "signal": (_SIGNAL, "error/position (mm)' or 'q[2] (deg)"),
    "measure": (_MEASURE, "last of contact_force (N)"),
    "is": (
        rf"{_MEASURE} (?P<relation>at most|at least) (?P<bound>#)",
        "largest of error/position (mm) after 0.5 s at most 1",
    ),
    "score": (rf"{_MEASURE}, worst (?P<worst>#), best (?P<best>#)", "rms of q[2] (deg), worst 9, best 1"),
    "control": (
        r"(?P<words>.+) = (?P<path>\S+) "
        r"(?:from (?P<low>#) to (?P<high>#)(?P<log>, log)?|in (?P<choices>\[.*\]))",
        'Label = horizon from 1 to 20\' or \'Label = controller in ["himpc", "osf"]',
    ),
    "option": (r"\((?:(?P<low>#) to (?P<high>#)|below (?P<below>#)|from (?P<least>#))\)", "option (1 to 2)"),
    "number": (r"(?P<low>#) to (?P<high>#)(?:, factor (?P<factor>#))?", "1 to 100, factor 1.5"),
    "draw": (r"(?P<low>#) to (?P<high>#) until (?P<until>#) s(?:, band (?P<band>#))?", "0 to 9 until 2 s"),
    "vector": (r"\((?P<numbers>#(?:, *#)*)\)", "(1, 2, 3)"),
    "integer": (r"(?P<integer>-?\d+)", "1"),
    "real": ("(?P<real>#)", "1.5"),
    "note": (
        rf"(?P<statement>given: .+|tested by \S+::\w+)|{_MEASURE} from (?P<low>#)(?: to (?P<high>#))?"
        r"(?: in (?P<on>[\w-]+))?(?: for (?P<seconds>#) s)?"
        rf"(?: with (?:(?P<ghost>the ghost's settings)|(?P<set>{_SETTINGS})))?"
        rf"(?:; (?P<effect>but|and) with (?P<without>{_SETTINGS})"
        r" from (?P<outside_low>#)(?: to (?P<outside_high>#))?)?",
        "range of q[2] (deg) from 28 to 30; but with `horizon=1` from 0 to 5",
    ),
}
"""The form of a value by its key (# is a number), and an example."""

_TEXT_GROUPS = {
    *("name", "unit", "statistic", "over_ghost", "relation", "words", "path", "choices", "numbers", "log"),
    *("statement", "on", "ghost", "set", "effect", "without"),
}
_MARK = re.compile(r"\[\^([\w-]+)\]")
_NOTE = re.compile(r"(\[\^[\w-]+\]): +(.*)")
_WITH_MARKS = ("predict", "option", "tempting", "claim", "because", "goal")
"""The keys of items whose values are texts, in which marks of notes may stand."""
_ITEM = re.compile(r"(?P<indent> *)- (?P<key>[a-z][a-z ]*?)(?P<more> [\d(][^:]*)?:(?: +(?P<value>.*))?")


@dataclass
class _Part:
    """A heading or an item: its place, key and value, what stands between key and colon, the items below it,
    and the texts of a heading by their own headings, with the marks of notes in them."""

    path: str
    line: int
    column: int
    key: str
    value: str
    more: str = ""
    items: list[_Part] = field(default_factory=list)
    texts: dict[str, list[str]] = field(default_factory=dict)
    marks: list[_Part] = field(default_factory=list)

    @contextmanager
    def named(self) -> Iterator[None]:
        """Adds file, line and column to the message of an error, unless it names its line already."""
        try:
            yield
        except ValueError as error:
            if str(error).startswith(f"{self.path}, line "):
                raise
            raise InputError(f"{self.path}, line {self.line}, column {self.column}: {error}") from None

    def text(self, heading: str = "") -> str:
        return "\n".join(self.texts.get(heading, [])).strip("\n")

    def with_marks(self) -> Iterator[str]:
        """Yields the texts in which marks of notes may stand, each in one line."""
        for item in self.items:
            yield from (item.value, *item.with_marks()) if item.key in _WITH_MARKS else ()
        for lines in self.texts.values():
            yield " ".join(" ".join(lines).split())

    def remove_marks(self) -> None:
        for item in self.items:
            if item.key in _WITH_MARKS:
                item.value = _MARK.sub("", item.value)
                item.remove_marks()
        self.texts = {name: [_MARK.sub("", line) for line in lines] for name, lines in self.texts.items()}

    def all(self, *keys: str) -> list[_Part]:
        return [item for item in self.items if item.key in keys]

    def one(self, key: str) -> _Part | None:
        """Returns the item with this key, or None. Raises InputError if there are several."""
        items = self.all(key)
        if len(items) > 1:
            with items[1].named():
                raise InputError(f"'- {key}:' stands twice: remove one of the two lines")
        return items[0] if items else None

    def needed(self, key: str) -> _Part:
        """Returns the item with this key. Raises InputError unless there is exactly one."""
        item = self.one(key)
        if item is None:
            with self.named():
                raise InputError(f"a line '- {key}: …' is missing")
        return item

    def groups(self, form: str = "", text: str | None = None) -> dict[str, Any]:
        """Returns the parts of a value, numbers as floats. Raises InputError if it does not have its form."""
        pattern, example = _FORMS[form or self.key]
        text = self.value if text is None else text
        match = re.fullmatch(pattern.replace("#", _NUMBER), text.strip())
        if match is None:
            with self.named():
                raise InputError(f"'{shortened(text, 100)}' does not have the form '{example}'")
        texts = {name: value for name, value in match.groupdict().items() if value is not None}
        return {name: value if name in _TEXT_GROUPS else float(value) for name, value in texts.items()}


def read_lesson(name: str, path: str, text: str, marks: bool = False) -> Lesson:
    """Returns the lesson with this name from the text of a Markdown file.

    Args:
        name: name of the lesson.
        path: its file, for messages, and for a robot or scene that is a file in the folder of the lesson.
        text: the text of the file.
        marks: whether the texts keep the marks of notes, which a learner does not see.

    Raises:
        InputError: with file, line and column.
    """
    head, *parts = _parts(path, text)
    noted = {part.line: _notes(part) for part in (head, *parts)}
    if not marks:
        for part in (head, *parts):
            part.remove_marks()
    question = " ".join(head.text().split())
    steps = tuple(_step(part, noted[part.line]) for part in parts if part.key == "step")
    challenges = [_challenge(part) for part in parts if part.key == "challenge"]
    robot, scene = head.one("robot"), head.needed("scene").value
    with head.named():
        if not question.endswith("?"):
            raise InputError("below the title stands a question that ends with '?'")
        if not steps or len(challenges) > 1:
            raise InputError("a lesson has at least one step '## Title', and at most one '## Challenge'")
        card = Card(
            head.value, question, int(head.needed("minutes").groups()["minutes"]), head.needed("needs").value
        )
        last, urdf = challenges[0] if challenges else None, _beside(path, robot.value) if robot else None
        return Lesson(name, card, _beside(path, scene), steps, _set(head), last, urdf)


def _beside(path: str, name: str) -> str:
    """Returns the path of a file that a lesson names relative to its own folder; any other name unchanged."""
    return str(Path(path).parent / name) if name.endswith((".urdf", ".xml", ".zip", ".py")) else name


def assignments(path: str, text: str) -> Iterator[tuple[int, str, str]]:
    """Yields the settings with which the runs of a lesson start: the number of the step (0: of all steps),
    the place in the file, and the setting."""
    for number, part in enumerate(_parts(path, text)):
        for item in part.all("set"):
            yield number, f"{path}, line {item.line}, column {item.column}", item.value


def _parts(path: str, text: str) -> list[_Part]:
    """Splits a file at its headings, separates items from texts, and refuses unknown keys."""
    parts: list[_Part] = []
    lines: list[str] = []
    item: _Part | None = None
    labels: set[str] = set()
    for number, line in enumerate(text.split("\n"), start=1):
        match, note = _ITEM.fullmatch(line.rstrip()), _NOTE.fullmatch(line.rstrip())
        heading = re.fullmatch("(#+) +(.*)", line.rstrip())
        here = _Part(path, number, 1, "", line)
        if (heading and len(heading[1]) < 3) or (not parts and line.strip()):
            with here.named():
                if not heading or (len(heading[1]) == 1) == bool(parts):
                    raise InputError("a lesson begins with '# Title', and each of its steps with '## Title'")
            kind = "challenge" if heading[2] == "Challenge" else "step" if parts else "lesson"
            lines = []
            parts.append(_Part(path, number, 1, kind, heading[2], texts={"": lines}))
            item = None
        elif heading:
            with here.named():
                if len(heading[1]) > 3 or heading[2] not in ("Now you", "Why"):
                    raise InputError(
                        f"'{line.strip()}' is no heading of a step: choose '### Now you' or '### Why'"
                    )
            lines, item = parts[-1].texts.setdefault(heading[2], []), None
        elif note:
            item = _Part(path, number, 1, "note", note[2], note[1])
            with item.named():
                if parts[-1].key != "step":
                    raise InputError(
                        f"the note '{note[1]}' stands in no step: put it into the step of its mark"
                    )
                if note[1] in labels:
                    raise InputError(
                        f"the note '{note[1]}' stands twice: choose another label for one of them"
                    )
            labels.add(note[1])
            parts[-1].items.append(item)
        elif match and (item or not match["indent"]):
            above = parts[-1] if not match["indent"] else parts[-1].items[-1]
            more, value = (match["more"] or "").strip(), match["value"] or ""
            item = _Part(path, number, match.start("key") + 1, match["key"], value, more)
            with item.named():
                if item.key not in _KEYS.get(above.key, ()):
                    raise unknown_name(f"key of a {above.key}", item.key, _KEYS.get(above.key, ()))
            above.items.append(item)
        elif item and line.startswith(" ") and line.strip():
            item.value = f"{item.value} {line.strip()}".strip()
        elif parts:
            lines.append(line.rstrip())
            item = None
        for mark in () if note else _MARK.finditer(line):
            parts[-1].marks.append(_Part(path, number, mark.start() + 1, "mark", mark[0]))
    if not parts:
        raise InputError(f"{path}, line 1, column 1: a lesson begins with '# Title'")
    return parts


def _notes(part: _Part) -> tuple[Note, ...]:
    """Returns the notes of a step, each with the words before its first mark."""
    says: dict[str, str] = {}
    for text in part.with_marks():
        for mark in _MARK.finditer(text):
            says.setdefault(mark[0], re.split(r"(?<=[.!?…]) ", _MARK.sub("", text[: mark.start()]))[-1])
    items = part.all("note")
    for mark in part.marks:
        with mark.named():
            if mark.value not in [item.more for item in items]:
                raise InputError(f"a line '{mark.value}: …' is missing in this step")
    for item in items:
        with item.named():
            if item.more not in says:
                raise InputError(f"no text of this step has the mark '{item.more}'")
    return tuple(_note(part, item, says[item.more]) for item in items)


def _note(part: _Part, item: _Part, says: str) -> Note:
    groups = item.groups()
    label = item.more[2:-1]
    with item.named():
        if "statement" in groups:
            return Note(label, says, statement=groups["statement"])
        measure = _measure(item)
        inside = groups["low"], groups.get("high", math.inf)
        outside = groups.get("outside_low", 0.0), groups.get("outside_high", math.inf)
        if ("ghost" in groups or measure.over_ghost) and part.one("ghost") is None:
            raise InputError(
                "there is no ghost in this step: write a line '- ghost: …' with settings below it"
            )
        if inside[0] > inside[1] or outside[0] > outside[1]:
            raise InputError("a range begins with its smaller number")
        if "effect" in groups:
            apart = inside[1] < outside[0] or outside[1] < inside[0]
            if apart != (groups["effect"] == "but"):
                raise InputError(
                    "after 'but with' stands a range that does not overlap the first one, and after 'and "
                    "with' one that does"
                )
        named = (groups.get("on", ""), groups.get("seconds"))
        without = _settings(groups.get("without", ""))
        return Note(
            label,
            says,
            measure,
            inside,
            _settings(groups.get("set", "")),
            "ghost" in groups,
            *named,
            without,
            outside if without else (0.0, 0.0),
        )


def _settings(text: str) -> tuple[str, ...]:
    """Returns the assignments in backticks."""
    texts = tuple(re.findall("`([^`]+)`", text))
    for assignment in texts:
        parse_assignment(assignment)
    return texts


def read_note(path: str, line: int, text: str) -> Note:
    """Returns a note that is beside a sentence of another text than a lesson. Raises InputError."""
    return _note(_Part(path, line, 1, "text", ""), _Part(path, line, 1, "note", text, "[^]"), "")


def read_test(path: str, text: str) -> Claim:
    """Returns a measure with its bound, as after `is:` in a lesson. Raises InputError."""
    item = _Part(path, 1, 1, "is", text)
    groups = item.groups()
    return Claim("", _measure(item), groups["relation"], groups["bound"])


def read_event(path: str, text: str) -> events.Event:
    """Returns an event, as after `at 0.5 s:` in a lesson. Raises InputError."""
    return _event(_Part(path, 1, 1, "at", text))


def _step(part: _Part, notes: tuple[Note, ...]) -> Step:
    duration, script = _run(part)
    ghost, prediction = part.one("ghost"), part.one("predict")
    with part.named():
        return Step(
            part.value,
            part.text(),
            part.text("Now you"),
            part.text("Why"),
            tuple(_claim(item) for item in part.all("claim")),
            _set(part),
            script,
            duration,
            _prediction(prediction) if prediction else None,
            Ghost(ghost.value, _set(ghost)) if ghost else None,
            tuple(_control(item) for item in part.all("control")),
            tuple(_signal(item) for item in part.all("plot")),
            notes,
        )


def _challenge(part: _Part) -> Challenge:
    duration, script = _run(part)
    score = part.needed("score")
    groups = score.groups()
    return Challenge(
        part.text(),
        tuple(_claim(item) for item in part.all("goal")),
        tuple(_control(item) for item in part.all("control")),
        Score(_measure(score), groups["worst"], groups["best"]),
        tuple(_set(item) for item in part.all("solution")),
        _set(part),
        duration,
        script,
    )


def _set(part: _Part, key: str = "set") -> tuple[str, ...]:
    for item in part.all(key):
        with item.named():
            parse_assignment(item.value)
    return tuple(item.value for item in part.all(key))


def _run(part: _Part) -> tuple[float, tuple[tuple[float, events.Event], ...]]:
    run = part.needed("run")
    return run.groups()["duration"], tuple((at.groups(text=at.more)["time"], _event(at)) for at in run.items)


def _signal(item: _Part) -> Signal:
    groups = item.groups()
    with item.named():
        column = None if "column" not in groups else int(groups["column"])
        return Signal(groups["name"], groups.get("unit", ""), column)


def _measure(item: _Part) -> Measure:
    groups = item.groups()
    window = groups.get("after", 0.0), groups.get("until", math.inf)
    return Measure(_signal(item), groups.get("statistic", "largest"), *window, "over_ghost" in groups)


def _claim(item: _Part) -> Claim:
    test = item.needed("is")
    groups = test.groups()
    claim = Claim(item.value, _measure(test), groups["relation"], groups["bound"])
    if item.key == "goal":
        return claim
    if not item.all("fails with"):
        item.needed("fails with")
    return replace(claim, fails_with=_set(item, "fails with"), because=item.needed("because").value)


def _control(item: _Part) -> Control:
    groups = item.groups()
    with item.named():
        choices = tuple(json.loads(groups["choices"])) if "choices" in groups else ()
        ends = groups.get("low", 0.0), groups.get("high", 0.0)
        return Control(groups["path"], groups["words"], *ends, "log" in groups, choices)


def _prediction(item: _Part) -> Prediction:
    drawn, number, options = item.one("draw"), item.one("number"), item.all("option", "tempting")
    if drawn:
        return Sketch(item.value, _signal(item.needed("signal")), **drawn.groups())
    measure = _measure(item.needed("measure"))
    if number:
        return Value(item.value, measure, **number.groups())
    tempting = [index for index, option in enumerate(options) if option.key == "tempting"]
    with item.named():
        if len(tempting) != 1:
            raise InputError("'- predict:' needs answers '- option (1 to 2): …', and one '- tempting (…): …'")
    ranges = [option.groups("option", option.more) for option in options]
    low = [groups.get("low", groups.get("least", -math.inf)) for groups in ranges]
    high = [groups.get("high", groups.get("below", math.inf)) for groups in ranges]
    made = tuple(Option(option.value, *ends) for option, *ends in zip(options, low, high, strict=True))
    return Choice(item.value, made, measure, tempting[0])


def _event(item: _Part) -> events.Event:
    """Returns the event of a line such as `push link_4, force (0, 20, 0), seconds 0.2`: words, the first
    field of the event, and other fields with their names."""
    with item.named():
        words = next((event for event in EVENTS if f"{item.value} ".startswith(f"{event} ")), None)
        if words is None:
            raise unknown_name("event", item.value, EVENTS)
        kind, rest = EVENTS[words], item.value.removeprefix(words).strip()
        if kind is events.Set:
            return events.Set(*parse_assignment(rest))
        known = {parameter.name: parameter for parameter in fields(kind)}
        first, *others = re.split(r", (?=[a-z])", rest)
        texts = {name: value for name, _, value in (part.partition(" ") for part in others)}
        if first and known:
            texts[next(iter(known))] = first
        needed = [name for name, parameter in known.items() if parameter.default is MISSING]
        if not set(needed) <= texts.keys() <= known.keys() or (first and not known):
            may = f", and can have {', '.join(known)}" if known else ""
            raise InputError(f"'{words}' needs {', '.join(needed) or 'nothing more'}{may}")
        values = {name: _value(item, str(known[name].type), text) for name, text in texts.items()}
        return kind(**values)


def _value(item: _Part, kind: str, text: str) -> Any:
    """Returns the value of a field of an event, by the type of the field."""
    if kind == "Vector":
        return tuple(float(number) for number in item.groups("vector", text)["numbers"].split(","))
    if kind == "int":
        return int(item.groups("integer", text)["integer"])
    if kind.startswith("float"):
        return None if text == "none" and "None" in kind else item.groups("real", text)["real"]
    return text
