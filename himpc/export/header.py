"""The C header of an exported controller."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from himpc.cascade.level import FALLBACKS
from himpc.export.image import MULTIPLE
from robots.errors import InputError


def header(manifest: dict[str, Any], torques: Sequence[float], prefix: str) -> str:
    """Returns the header of a controller.

    Args:
        manifest: the manifest of its `Image`.
        torques: N·m, the largest torque of each joint.
        prefix: see `renamed`.
    """
    tasks, levels = manifest["tasks"], manifest["levels"]
    at = {array["name"]: array["offset"] for array in manifest["arrays"]}
    names = {
        **{name: at[name] for name in ("error", "active", "fallback", "solved_index")},
        "digest": f"0x{manifest['digest']}ULL",
        "multiple": f"{MULTIPLE:g}",
        "controller": manifest["controller"],
        "robot": _plain(manifest["robot"]),
        "joints": ", ".join(map(_plain, manifest["joints"])),
        "n": len(manifest["joints"]),
        "horizon": manifest["horizon"],
        "bytes": manifest["bytes"],
        "period": repr(float(manifest["period_s"])),
        "fallbacks": ", ".join(f"{prefix.upper()}_{name.upper()}" for name in FALLBACKS),
        "fallback_names": _strings(FALLBACKS),
        "tasks": "; ".join(
            f"{_plain(task['name'])} ({task['rows']} rows, {task['target']} target)" for task in tasks
        ),
        "task_count": len(tasks),
        "task_names": _strings([task["name"] for task in tasks]),
        "task_first": ", ".join(str(task["first"]) for task in tasks),
        "task_rows": ", ".join(str(task["rows"]) for task in tasks),
        "levels": "; ".join(_plain(level["name"]) for level in levels),
        "level_count": len(levels),
        "level_names": _strings([level["name"] for level in levels]),
        "level_rows": ", ".join(str(level["rows"]) for level in levels),
        "torques": ", ".join(repr(float(torque)) if torque < 1e300 else "HUGE_VAL" for torque in torques),
        "most_rows": max([len(manifest["joints"]), *(entry["rows"] for entry in (*tasks, *levels))]),
    }
    text = renamed((Path(__file__).parent / "files" / "himpc.h").read_text("utf-8"), prefix)
    return re.sub(r"@(\w+)@", lambda match: str(names[match[1]]), text)


def renamed(text: str, prefix: str) -> str:
    """Returns the text of a file with `prefix` in place of himpc in all names of functions, constants and
    files."""
    return re.sub(
        r"\b(himpc|HIMPC)(?=[_.])", lambda match: prefix if match[1].islower() else prefix.upper(), text
    )


def check_prefix(prefix: str) -> None:
    """Raises InputError if names in C cannot begin with a prefix."""
    if not re.fullmatch(r"[a-z][a-z0-9_]{0,29}", prefix):
        raise InputError(
            f"--prefix {prefix}: give at most 30 lower-case letters, digits and underscores that begin "
            "with a letter, such as left"
        )


def _plain(name: str) -> str:
    """Returns a name for a comment, without characters that would end the comment."""
    return "".join(character if character.isalnum() or character in "_-. +" else "?" for character in name)


def _strings(names: Sequence[str]) -> str:
    """Returns names as string literals of C."""
    return ", ".join(f'"{"".join(map(_letter, name.encode()))}"' for name in names)


def _letter(byte: int) -> str:
    return (
        chr(byte)
        if chr(byte).isascii() and (chr(byte).isalnum() or chr(byte) in "_-. +")
        else f"\\{byte:03o}"
    )
