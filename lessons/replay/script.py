"""Writes a short Python script that repeats a run."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import fields
from typing import Any

import numpy as np

from lessons.events import Event, Reset
from lessons.own.files import is_file
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import differences, parse_assignment
from lessons.settings.settings import SceneSettings, settings_after

Log = Sequence[tuple[float, Event]]


def script(run: RunSpec, log: Log, duration: float) -> str:
    """Returns a stand-alone script that repeats a run to the last bit on the same machine.

    The script begins at the last reset, with the settings that were in force then. Earlier events are left
    out.

    Args:
        run: the run at its start, before all events in the log.
        log: `Session.log`, (time in s, event) of every event that took effect.
        duration: s since the last reset, `Session.t`.

    Raises:
        InputError: the run cannot be prepared, or its settings cannot be written as assignments.
    """
    scene = run.prepared()
    resets = [index for index, (_, event) in enumerate(log) if isinstance(event, Reset)]
    start = resets[-1] + 1 if resets else 0
    settings = settings_after(scene.settings, (event for _, event in log[:start]))
    assignments = differences(run.loaded().settings, settings)
    events = log[start:]
    own = next((text for text in assignments if text.startswith("controller=") and is_file(text)), None)
    assignments = tuple(text for text in assignments if text != own)
    find = ", ".join(map(repr, _arguments(run))) + (f", hold={run.hold!r}" if run.hold else "")
    parts = [
        _HEAD.format(
            what=f"{run.scene} under {settings.controller}, {duration:g} s",
            when=" since the last reset" if resets else "",
            caution=_CAUTION if _measures_time(settings, events) else "",
        ),
        *_imports(events),
        _IMPORTS,
        f"SCENE = {'scene_named' if is_file(run.scene) else 'load_scene'}({find})",
        *((f"SCENE = with_tasks(SCENE, {run.tasks!r})",) if run.tasks else ()),
        f"CONTROLLER = {None if own is None else parse_assignment(own)[1]!r}",
        _tuple("SETTINGS", map(repr, assignments)),
        _tuple("EVENTS", (f"({_literal(float(t))}, {_call(event)})" for t, event in events)),
        f"DURATION = {_literal(float(duration))}  # s",
        f"SEED = {run.seed}",
        _TAIL,
    ]
    return "\n".join(parts)


_HEAD = '''"""{what}{when}, as exported by himpc-lab.

python THIS_FILE [FILE.npz] repeats the run, prints its summary and saves one row per control tick.{caution}
"""

import json
import os
import sys
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")  # as himpc-lab does, before NumPy is imported

import numpy as np
'''

_CAUTION = """
Measured computing times changed the run, so every repetition is a little different."""

_IMPORTS = """from lessons import arrays, load_scene, prepared, run, scene_named, summary, with_tasks
"""

_TAIL = """
scene = replace(prepared(SCENE, CONTROLLER, SETTINGS), events=EVENTS)
recording = run(scene, DURATION, SEED, to_the_end=True)
print(json.dumps(summary(recording), indent=2))
if len(sys.argv) > 1:
    np.savez_compressed(sys.argv[1], **arrays(recording, {"scene": SCENE.name, "seed": SEED}))
"""


def _arguments(run: RunSpec) -> tuple[str | None, ...]:
    if run.tip is not None:
        return (run.scene, run.urdf, run.tip)
    return (run.scene,) if run.urdf is None else (run.scene, run.urdf)


def _measures_time(settings: SceneSettings, events: Log) -> bool:
    """Returns whether the run depended on measured times at any moment."""
    for event in (None, *(event for _, event in events)):
        settings = settings if event is None else settings_after(settings, (event,))
        if settings.measures_time:
            return True
    return False


def _imports(events: Log) -> list[str]:
    names = sorted({type(event).__name__ for _, event in events})
    return [f"from lessons.events import {', '.join(names)}"] if names else []


def _tuple(name: str, items: Iterable[str]) -> str:
    lines = "".join(f"    {item},\n" for item in items)
    return f"{name} = (\n{lines})" if lines else f"{name} = ()"


def _call(event: Event) -> str:
    """Returns the Python call that creates an event, without arguments that have their default value."""
    arguments = [
        f"{field.name}={_literal(value)}" if index > 1 else _literal(value)
        for index, field in enumerate(fields(event))
        if (value := getattr(event, field.name)) != field.default
    ]
    return f"{type(event).__name__}({', '.join(arguments)})"


def _literal(value: Any) -> str:
    """Returns a Python literal: NumPy's numbers and arrays become plain numbers and lists."""
    if isinstance(value, (np.ndarray, np.generic)):
        return _literal(value.tolist())
    if isinstance(value, (list, tuple)):
        inner = ", ".join(_literal(element) for element in value)
        return f"[{inner}]" if isinstance(value, list) else f"({inner},)" if len(value) == 1 else f"({inner})"
    return repr(value)
