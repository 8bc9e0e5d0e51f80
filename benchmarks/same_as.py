"""Compares the results of all scenes under all controllers with those of another commit.

python benchmarks/same_as.py COMMIT [--seconds S] [--scenes NAME ...] runs every scene with every controller
that fits, without a page, here and in a checkout of COMMIT. It compares the results that the option --json of
`himpc-lab run` writes, except the keys of `TIMING`. With --tolerance T, two numbers may differ by T times the
larger of the two, or by 1e-9 if that is more, and the keys of `_HOW` (the route and its residuals) are not
compared. The exit code is 1 if any result differs.
"""

from __future__ import annotations

import argparse
import json
import math
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

ROOT = Path(__file__).parents[1]
TIMING = ("step_ms", "real_time_factor", "late_ticks")
"""Keys whose values differ between runs."""
NEW: tuple[str, ...] = ("levels",)
"""Keys that COMMIT may not have."""
_HOW = {"route", "max_kkt_residual"}
"""Keys of a result that describe how it was computed."""

_RUNS = """
import json, sys
from app.__main__ import main
folder, seconds = sys.argv[1], sys.argv[2]
for name in sys.argv[3:]:
    scene, controller = name.split("/")
    file = f"{folder}/{scene}+{controller}.json"
    what = ["run", scene, "--controller", controller, "--duration", seconds, "--seed", "3"]
    code = main([*what, "--json", file])
    if code:
        open(file, "w").write(json.dumps({"exit": code}))
"""


def main() -> int:
    """Prints a line per difference."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("commit")
    parser.add_argument("--seconds", type=float, default=0.5)
    parser.add_argument("--tolerance", type=float, default=0.0)
    parser.add_argument("--scenes", nargs="*")
    given = parser.parse_args()
    names = [each for each in _names() if given.scenes is None or each.split("/")[0] in given.scenes]
    with tempfile.TemporaryDirectory() as folder:
        then, now, before = (Path(folder) / name for name in ("then", "now", "before"))
        then.mkdir()
        now.mkdir()
        subprocess.run(
            ["git", "worktree", "add", "-q", "--detach", before, given.commit], cwd=ROOT, check=True
        )
        try:
            for tree, out in ((before, then), (ROOT, now)):
                command = [sys.executable, "-c", _RUNS, str(out), str(given.seconds), *names]
                subprocess.run(command, cwd=tree, env=_environment(tree), check=True)
        finally:
            subprocess.run(["git", "worktree", "remove", "--force", before], cwd=ROOT, check=True)
        different = sum(_differs(name, then, now, given.tolerance) for name in names)
    print(f"{len(names)} runs compared, {different} differ")
    return 1 if different else 0


def _names() -> list[str]:
    """Returns SCENE/CONTROLLER for all combinations that fit."""
    from himpc.catalog import CONTROLLERS, VELOCITY_CONTROLLERS
    from lessons.scenes.names import SCENES, VELOCITY_SCENES

    torque = [f"{scene}/{each}" for scene in SCENES if scene != "hold" for each in CONTROLLERS]
    return torque + [f"{scene}/{each}" for scene in VELOCITY_SCENES for each in VELOCITY_CONTROLLERS]


def _environment(tree: Path) -> dict[str, str]:
    import os

    return {**os.environ, "PYTHONPATH": str(tree)}


def _differs(name: str, then: Path, now: Path, tolerance: float) -> bool:
    file = name.replace("/", "+") + ".json"
    before, after = (_plain(json.loads((folder / file).read_text())) for folder in (then, now))
    keys = sorted(before.keys() | after.keys() - set(NEW))
    different = [key for key in keys if not _same(before.get(key), after.get(key), tolerance)]
    for key in different:
        print(f"{name}: {key} was {before.get(key)} and is {after.get(key)}")
    return bool(different)


def _same(before: Any, after: Any, tolerance: float) -> bool:
    """Returns whether two parts of a JSON object are equal, with numbers equal up to the tolerance."""
    if isinstance(before, dict) and isinstance(after, dict):
        keys = before.keys() - (_HOW if tolerance > 0 else set())
        return before.keys() == after.keys() and all(_same(before[k], after[k], tolerance) for k in keys)
    if isinstance(before, list) and isinstance(after, list):
        pairs = zip(before, after, strict=False)
        return len(before) == len(after) and all(_same(b, a, tolerance) for b, a in pairs)
    if isinstance(before, float) and isinstance(after, float) and tolerance > 0:
        return math.isclose(before, after, rel_tol=tolerance, abs_tol=1e-9)
    return bool(before == after)


def _plain(result: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in result.items() if key not in TIMING}


if __name__ == "__main__":
    sys.exit(main())
