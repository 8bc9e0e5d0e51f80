"""All modules and compiled functions are loaded before the first tick, so that a moving robot never waits for
an import."""

from __future__ import annotations

import json
import subprocess
import sys

RUNS = (
    "iiwa14-circle/himpc",
    "planar3-hold/nhimpc",
    "planar3-hold/weighted",
    "planar3-hold/osf_damped",
    "planar3-hold/tdeosf",
    "planar3-hold/hqp",
    "planar3-plane/himpc",
    "ridgeback-ur10-drag/htmpc",
    "ridgeback-ur10-square/htidkc",
    "iiwa14-htmpc/placo",
)

LOOK = """
import json, sys

from himpc.compilation import private
from lessons.events import MoveTarget
from lessons.scenes.catalog import load_scene, prepared
from lessons.session.start import begin

late = []
loaded = private.load
private.load = lambda function, arguments: late.append(function.__name__) or loaded(function, arguments)
for name in sys.argv[1:]:
    scene, _, controller = name.partition("/")
    session = begin(prepared(load_scene(scene), controller, []))
    late.clear()
    before = set(sys.modules)
    session.tick()
    for task in session.layout.tasks:
        target = getattr(session, "references", {}).get(task.name)
        if hasattr(target, "raw") and target.raw.ndim == 1:
            session.post(MoveTarget(task.name, tuple(target.raw + 0.01)))
    session.tick()
    session.tick()
    late.extend(sorted(set(sys.modules) - before))
    print(json.dumps([name, late]))
"""


def test_no_tick_imports_or_loads_anything() -> None:
    """Nothing is imported in the first tick of a controller, or when targets are dragged for the first time.
    One process executes all runs, because the first run would show a late import."""
    done = subprocess.run(
        [sys.executable, "-c", LOOK, *RUNS], capture_output=True, text=True, timeout=300, check=True
    )
    late = dict(json.loads(line) for line in done.stdout.splitlines())
    assert late == {name: [] for name in RUNS}
