"""All settings as data, and as a short code to share."""

from __future__ import annotations

import base64
import binascii
import json
import re
import zlib
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

from lessons.course import COURSE
from lessons.own.files import fingerprint, is_file
from lessons.scenes.names import SCENES, VELOCITY_SCENES
from lessons.scenes.run_spec import MAX_SEED, RunSpec
from lessons.settings.assignments import assignment, differences, parse_assignment
from lessons.settings.settings import SceneSettings
from robots import CATALOG, InputError
from robots.errors import unknown_name

VERSION = 1
"""Version of the format; a higher number means that an older himpc-lab cannot read the code."""

MAX_CODE = 12_000
"""Largest number of characters of a code, which still fits into a link or a chat message."""
_MAX_TEXT = 60_000
_MAX_ASSIGNMENTS = 500
_MAX_ASSIGNMENT = 2_000
_PREFIX = re.compile(r"hl(\d{1,6})-")
_KEYS = {"scene": "s", "urdf": "r", "tip": "t", "hold": "h", "set": "a", "seed": "n", "lesson": "l"} | {
    "step": "p"
}


@dataclass(frozen=True)
class State:
    """All settings of a run, without its history.

    Attributes:
        run: the run; its assignments contain all differences from the scene's own settings. It has no events
            and lasts as long as the scene.
        lesson: name of the active lesson.
        step: place of the active step in the lesson; the first step has place 1.
    """

    run: RunSpec
    lesson: str | None = None
    step: int | None = None


def state_of(
    run: RunSpec,
    settings: SceneSettings,
    *,
    lesson: str | None = None,
    step: int | None = None,
    before: SceneSettings | None = None,
) -> State:
    """Returns the state of a scene whose settings have been changed.

    Args:
        run: scene, robot and seed.
        settings: the present settings.
        lesson, step: see `State`.
        before: the settings of the scene with its files, before any assignment; None: the scene is loaded.

    Raises:
        InputError: the scene cannot be loaded, or the settings cannot be written as assignments.
    """
    files = tuple(filter(is_file, settings.controllers))
    own = replace(run, controller=None, set=(), events=None, duration=None, files=files)
    before = own.loaded().settings if before is None else before
    return State(replace(own, set=differences(before, settings)), lesson, step)


# ------------------------------------------------------------------ codes


def encode(state: State) -> str:
    """Returns the state as a code that fits into a link: letters, digits, "-" and "_".

    Raises:
        InputError: the run needs the file of a robot or a scene, which a code cannot contain; or the code
            would be too long.
    """
    run = state.run
    if run.urdf is not None and run.urdf not in CATALOG:
        raise InputError(
            "a code cannot contain a robot from a file: pass on the file and the command line instead"
        )
    if is_file(run.scene):
        raise InputError("a code cannot contain a scene from a file: pass on the file and the command line")
    assignments = run.set if run.controller is None else (assignment("controller", run.controller), *run.set)
    assignments = tuple(map(_carried, assignments))
    known = {**vars(run), "set": assignments, "lesson": state.lesson, "step": state.step}
    data = {short: known[name] for name, short in _KEYS.items() if known[name] not in (None, (), 0)}
    text = json.dumps(data, ensure_ascii=False, separators=(",", ":")).encode()
    code = f"hl{VERSION}-" + base64.urlsafe_b64encode(zlib.compress(text, 9)).decode().rstrip("=")
    if len(code) > MAX_CODE or len(text) > _MAX_TEXT or not _fits(assignments):
        raise InputError("this setting is too long for a code: use the command line or the script instead")
    return code


def _carried(text: str) -> str:
    """Returns an assignment in the form that a code contains: a user's file is replaced by its
    fingerprint."""
    path, value = parse_assignment(text)
    if path == "controller" and is_file(value):
        return assignment(path, fingerprint(value))
    return assignment(path, _marked(value)) if path == "stack" and ".py" in text else text


def _marked(value: Any) -> Any:
    if isinstance(value, list):
        return [_marked(element) for element in value]
    if not isinstance(value, dict):
        return value
    own = isinstance(value.get("task"), str) and is_file(value["task"])
    return {key: fingerprint(item) if own and key == "task" else _marked(item) for key, item in value.items()}


def decode(code: str) -> State:
    """Returns the state in a code. A code is data only: names and numbers, which are checked once more when
    the scene is prepared. Nothing in it is executed, and it opens no file.

    Raises:
        InputError: the text is not a code, is incomplete or changed, or was made by a newer version.
    """
    body = _body("".join(code.split()))
    try:
        packed = base64.urlsafe_b64decode(body + "=" * (-len(body) % 4))
        if base64.urlsafe_b64encode(packed).decode().rstrip("=") != body:
            raise ValueError
        unpacking = zlib.decompressobj()
        text = unpacking.decompress(packed, _MAX_TEXT)
        if not unpacking.eof or unpacking.unused_data:
            raise ValueError
        data = json.loads(text.decode(), parse_constant=_no_constant)
    except (ValueError, binascii.Error, zlib.error, RecursionError):
        raise InputError("the code is incomplete or was changed: copy all of it again") from None
    return _checked(data)


def _body(code: str) -> str:
    match = _PREFIX.match(code)
    if match is None or not re.fullmatch(r"[\w-]+", code, re.ASCII):
        raise InputError(
            f"this is not a state code: a code begins with hl{VERSION}- and has only letters, digits, - and _"
        )
    if int(match[1]) > VERSION:
        raise InputError(
            f"the code was made by a newer himpc-lab (format {match[1]}, yours reads {VERSION}): update yours"
        )
    if int(match[1]) < 1:
        raise InputError(f"this is not a state code: there is no format {match[1]}, the first one is 1")
    if len(code) > MAX_CODE:
        raise InputError(
            f"the code has {len(code)} characters and at most {MAX_CODE} are allowed: copy it again"
        )
    return code[match.end() :]


def _no_constant(constant: str) -> Any:
    raise ValueError(constant)


def _checked(data: Any) -> State:
    if not isinstance(data, dict) or not data.keys() <= set(_KEYS.values()):
        raise InputError("the code does not contain a state of himpc-lab: copy it again")
    scene = _text(data, "s", "scene") or ""
    if scene not in SCENES and scene not in VELOCITY_SCENES:
        raise unknown_name("scene", scene, (*SCENES, *VELOCITY_SCENES))
    urdf = _text(data, "r", "robot")
    if urdf is not None and urdf not in CATALOG:
        raise InputError(
            "the code names a robot that is not in the catalog, and a code may not open files: "
            "start with --urdf and your own file instead"
        )
    assignments, hold = _texts(data, "a", "settings"), _texts(data, "h", "joints to hold")
    lesson = _text(data, "l", "lesson")
    if lesson is not None and lesson not in COURSE:
        raise unknown_name("lesson", lesson, COURSE)
    run = RunSpec(
        scene,
        urdf,
        _text(data, "t", "tip"),
        set=tuple(_of_today(assignments)),
        seed=_whole(data, "n", "seed", MAX_SEED) or 0,
        hold=tuple(hold),
    )
    return State(run, lesson, _whole(data, "p", "step", 100))


def _of_today(assignments: list[str]) -> list[str]:
    """Codes of earlier versions may name a solver for a controller that has none today."""
    without = {f"controller={name}" for name in ("hiqp", "nhimpc", "weighted", "himpc_filtered")}
    gone = "route=explicit" in assignments and not without.isdisjoint(assignments)
    return [text for text in assignments if not (gone and text.startswith("solver="))]


def _fits(assignments: tuple[str, ...] | list[str]) -> bool:
    return len(assignments) <= _MAX_ASSIGNMENTS and all(len(text) <= _MAX_ASSIGNMENT for text in assignments)


def _wrong(what: str) -> InputError:
    return InputError(f"the {what} in the code is not valid: copy it again")


def _text(data: Mapping[str, Any], key: str, what: str) -> str | None:
    value = data.get(key)
    if value is not None and not (isinstance(value, str) and len(value) <= 200 and value.isprintable()):
        raise _wrong(what)
    return value


def _texts(data: Mapping[str, Any], key: str, what: str) -> list[str]:
    value = data.get(key, [])
    if not isinstance(value, list) or not all(isinstance(text, str) for text in value):
        raise _wrong(f"list of {what}")
    if not _fits(value):
        raise _wrong(f"number or length of {what}")
    return value


def _whole(data: Mapping[str, Any], key: str, what: str, largest: int) -> int | None:
    value = data.get(key)
    if value is not None and not (type(value) is int and 0 <= value <= largest):
        raise _wrong(what)
    return value
