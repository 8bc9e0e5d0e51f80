"""Compares what the program computes with what another commit computes, bit by bit.

python -m benchmarks.same_as COMMIT [NAME ...] [--keep FOLDER] runs, in a checkout of COMMIT and here:

- every scene with every controller that fits: the JSON of `himpc-lab run` but for its timing, and the sha256
  of each array of its npz (torques, velocities, errors, active rows …);
- the list of settings of every scene, and the settings to which codes of COMMIT are decoded;
- the verdicts of `himpc-lab lessons --check`, except for those on notes.

A NAME selects the results that begin with it (`iiwa14-circle`, `lessons`). With --keep, the results of COMMIT
are kept in FOLDER and used again. With --tolerance T, two numbers of a JSON may differ by T times the larger
one, or by 1e-9 if that is more; arrays and keys that say how a result was found are then not compared. Digits
depend on the processor: compare on one machine. The exit code is 1 if any result differs.
"""

from __future__ import annotations

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
TIMING = ("step_ms", "real_time_factor", "late_ticks")
"""Keys whose values differ between runs."""
_HOW = {"route", "max_kkt_residual", "arrays"}
"""Keys of a result that describe how it was computed."""

_RUN = """
import hashlib, io, json, sys, contextlib
from pathlib import Path
import numpy as np
from app.__main__ import main
from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS
from lessons.scenes.names import SCENES, VELOCITY_SCENES
folder, codes, wanted = Path(sys.argv[1]), Path(sys.argv[2]), tuple(sys.argv[3:])
def write(name, what):
    (folder / (name.replace("/", "+") + ".json")).write_text(json.dumps(what))
def said(*command):
    out = io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(out):
        code = main([*command, "--json", "-"])
    try:
        return json.loads(out.getvalue())
    except ValueError:
        return {"exit": code}
torque = [name for name in SCENES if name != "hold"]
levels = (torque, CONTROLLERS, "0.6"), (VELOCITY_SCENES, VELOCITY_CONTROLLERS, "6")
def digest(array):
    return hashlib.sha256(array.tobytes()).hexdigest()[:16]
for scenes, controllers, seconds in levels:
    for scene in scenes:
        for controller in controllers:
            name, npz = f"{scene}/{controller}", folder / "rows.npz"
            if name.startswith(wanted):
                options = "--controller", controller, "--duration", seconds, "--seed", "3"
                result = said("run", scene, *options, "--npz", str(npz))
                if npz.exists():
                    rows = np.load(npz)
                    keys = sorted(key for key in rows.files if "_us" not in key and key != "settings")
                    result["arrays"] = {key: digest(rows[key]) for key in keys}
                    npz.unlink()
                write(name, result)
        if f"settings/{scene}".startswith(wanted):
            write(f"settings/{scene}", said("run", scene, "--settings"))
        if f"codes/{scene}".startswith(wanted):
            file = codes / f"{scene}.code"
            if not file.exists():
                from dataclasses import replace
                from lessons.replay.state import State, encode
                from lessons.scenes.run_spec import RunSpec
                spec = RunSpec(scene)
                for line in said("run", scene, "--settings"):
                    for value in "true", "0.31", "7", "0.9":
                        try:
                            more = spec.admitting(f"{line['path']}={value}")
                            more.prepared()
                            spec = more
                            break
                        except Exception:
                            continue
                file.write_text(encode(State(replace(spec, seed=5))))
            write(f"codes/{scene}", said("run", "--state", file.read_text(), "--settings"))
if "lessons".startswith(wanted):
    told = said("lessons", "--check")
    for lesson in told["lessons"]:
        lesson["checks"] = [check for check in lesson["checks"] if not check["what"].startswith("[^")]
    write("lessons", told)
"""


def main() -> int:
    """Prints a line per difference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("commit")
    parser.add_argument("names", nargs="*", default=[""])
    parser.add_argument("--keep", type=Path)
    parser.add_argument("--tolerance", type=float, default=0.0)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as temporary:
        kept = (options.keep or Path(temporary) / "then").resolve()
        now, tree = Path(temporary) / "now", Path(temporary) / "tree"
        now.mkdir()
        if not kept.exists():
            kept.mkdir(parents=True)
            subprocess.run(
                ["git", "worktree", "add", "-q", "--detach", tree, options.commit], cwd=ROOT, check=True
            )
            try:
                _run(tree, kept, kept, [""] if options.keep else options.names)
            finally:
                subprocess.run(["git", "worktree", "remove", "--force", tree], cwd=ROOT, check=True)
        _run(ROOT, now, kept, options.names)
        found = {file.name for file in now.glob("*.json")}
        names = sorted(name for name in found if (kept / name).exists())
        for name in sorted(found.difference(names)):
            print(f"{name.removesuffix('.json')}: new, not compared")
        different = sum(_differs(name, kept, now, options.tolerance) for name in names)
    print(f"{len(names)} results compared, {different} differ")
    return 1 if different or not names else 0


def _run(tree: Path, out: Path, codes: Path, names: list[str]) -> None:
    command = [sys.executable, "-c", _RUN, str(out), str(codes), *names]
    subprocess.run(command, cwd=tree, env={**os.environ, "PYTHONPATH": str(tree)}, check=True)


def _differs(name: str, then: Path, now: Path, tolerance: float) -> bool:
    before, after = (_plain(json.loads((folder / name).read_text())) for folder in (then, now))
    paths = list(_differences(before, after, tolerance))
    for path, old, new in paths[:8]:
        print(f"{name.removesuffix('.json')}: {path} was {str(old)[:80]} and is {str(new)[:80]}")
    return bool(paths)


def _differences(before: Any, after: Any, tolerance: float, path: str = "") -> Any:
    """Yields the path, the old and the new value of each difference between two JSON values."""
    if isinstance(before, dict) and isinstance(after, dict):
        for key in sorted((before.keys() | after.keys()) - (_HOW if tolerance > 0 else set())):
            yield from _differences(before.get(key), after.get(key), tolerance, f"{path}.{key}".strip("."))
    elif isinstance(before, list) and isinstance(after, list) and len(before) == len(after):
        for index, (old, new) in enumerate(zip(before, after, strict=True)):
            yield from _differences(old, new, tolerance, f"{path}[{index}]")
    elif isinstance(before, float) and isinstance(after, float) and tolerance > 0:
        if not math.isclose(before, after, rel_tol=tolerance, abs_tol=1e-9):
            yield path, before, after
    elif before != after:
        yield path, before, after


def _plain(result: Any) -> Any:
    return {k: v for k, v in result.items() if k not in TIMING} if isinstance(result, dict) else result


if __name__ == "__main__":
    sys.exit(main())
