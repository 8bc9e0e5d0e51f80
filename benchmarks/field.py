"""Tries the robots in folders of other people's files: which load, and which move well.

    python -m benchmarks.field DIR_OR_FILE… [--out FILE.md] [--seconds 120]

Each file is checked by `himpc-lab robots --check` in a process of its own. The table has a row per file: how
many joints move, the tip, the size of its largest link, as meshes draw it, as a share of the arm's length,
and how the robot follows a dragged target, or the first reason of a refusal. A summary is at its end.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

from robots.errors import listed
from robots.loading.archive import is_description
from robots.loading.imported import WRONG_SIZE


@dataclass(frozen=True)
class Tried:
    """A file: whether a robot was loaded from it, whether it follows (None: it was not dragged), the size of
    its largest link (None: it has no meshes), and the cells of its row."""

    name: str
    loads: bool
    follows: bool | None
    drawn: float | None
    cells: tuple[str, str, str, str]

    @property
    def wrong_size(self) -> bool:
        """Whether the meshes have another size than the kinematics, as with a wrong unit."""
        return self.drawn is not None and not WRONG_SIZE[0] <= self.drawn <= WRONG_SIZE[1]


def tried(path: Path, name: str, seconds: float) -> Tried:
    """Checks a file in a process of its own, for at most `seconds` of wall time."""
    command = (sys.executable, "-m", "app", "robots", "--check", str(path), "--json", "-")
    try:
        done = subprocess.run(command, capture_output=True, text=True, timeout=seconds, check=False)
    except subprocess.TimeoutExpired:
        return _not_loaded(name, f"takes longer than {seconds:g} s")
    try:
        told = json.loads(done.stdout)
    except ValueError:
        last = (done.stderr.strip().splitlines() or [f"exit code {done.returncode}"])[-1]
        return _not_loaded(name, f"no answer: {last}")
    refused = [each for each in told["findings"] if each["kind"] == "refused"]
    if refused:
        return _not_loaded(name, f"refused: {refused[0]['where']}: {refused[0]['text']}")
    motion = told["motion"]
    follows = motion["follows"] if motion["drag"] else None
    size = "" if told["drawn"] is None else f"{told['drawn']:.2g}"
    cells = str(len(told["joints"])), told["tip"], size, motion["text"]
    return Tried(name, True, follows, told["drawn"], cells)


def _not_loaded(name: str, why: str) -> Tried:
    return Tried(name, False, None, None, ("", "", "", why))


def files_in(places: list[str]) -> list[tuple[Path, str]]:
    """Returns every robot file of the folders, with its path in the folder, without links to the same
    file."""
    found: dict[Path, str] = {}
    for place in map(Path, places):
        inside = sorted(place.rglob("*")) if place.is_dir() else [place]
        for path in inside:
            if path.is_file() and is_description(path):
                found.setdefault(
                    path.resolve(), str(path.relative_to(place)) if place.is_dir() else path.name
                )
    return list(found.items())


def summary(rows: list[Tried]) -> str:
    """Returns the numbers of files that load, that follow, and that are drawn at a wrong size."""
    loaded = [row for row in rows if row.loads]
    dragged = [row for row in loaded if row.follows is not None]
    drawn = [row for row in loaded if row.drawn is not None]
    wrong = [row.name for row in drawn if row.wrong_size]
    follow = sum(row.follows is True for row in dragged)
    return (
        f"{len(loaded)} of {len(rows)} files load; {follow} of {len(dragged)} dragged robots follow "
        f"within 1 % of the drag after 2 s; {len(wrong)} of {len(drawn)} robots with meshes are drawn at a "
        f"wrong size{f' ({listed(wrong, 20)})' if wrong else ''}."
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("places", nargs="+", metavar="DIR_OR_FILE")
    parser.add_argument("--out", type=Path)
    parser.add_argument("--seconds", type=float, default=120.0, help="wall time for a file")
    options = parser.parse_args()
    rows, lines = [], ["| file | joints | tip | size | motion, or why not |", "|---|--:|---|--:|---|"]
    for path, name in files_in(options.places):
        rows.append(tried(path, name, options.seconds))
        cells = (cell.replace("|", "/").replace("\n", " ") for cell in (name, *rows[-1].cells))
        lines.append(f"| {' | '.join(cells)} |")
        print(lines[-1], flush=True)
    lines += ["", summary(rows)]
    print(lines[-1])
    if options.out is not None:
        options.out.write_text("\n".join(lines) + "\n")


if __name__ == "__main__":
    main()
