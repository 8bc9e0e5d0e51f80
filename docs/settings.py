"""Writes docs/settings.md from the table of settings: `python -m docs.settings`."""

from __future__ import annotations

from pathlib import Path

from lessons.scenes.catalog import load_scene
from lessons.scenes.names import SCENES, VELOCITY_SCENES
from lessons.settings.listing import SettingLine, reference

FILE = Path(__file__).with_name("settings.md")

_HEAD = """# Settings

These are the settings that `--set PATH=VALUE` and the page's controls change. `himpc-lab run SCENE
--settings` lists the settings of one scene with their present values. In a path, `*` is a name or a place:
`levels.position.Q` or `levels.1.Q`. If a value is a list with one number per joint, a number after the path
selects a joint: `M_bar.3=0.05`. In the same way, `gains.2=0.4` selects the gain of a level.
`obstacles.NAME=[x,y,z,radius]` adds a ball, and `obstacles.NAME=null` removes it.

Made by `python -m docs.settings`.
"""


def text() -> str:
    """Returns the whole file."""
    torque = [name for name in SCENES if name != "hold"]
    return "\n".join(
        [
            _HEAD,
            *_table("Torque-level scenes", torque),
            "",
            *_table("Velocity-level scenes", list(VELOCITY_SCENES)),
            "",
        ]
    )


def _table(title: str, scenes: list[str]) -> list[str]:
    found = reference([load_scene(name).settings for name in scenes])
    head = [f"## {title}", "", "| path | allowed | unit | what it is |", "|---|---|---|---|"]
    return head + [_row(line) for line in found]


def _row(line: SettingLine) -> str:
    return f"| `{line.path}` | {line.allowed} | {line.unit} | {line.help.replace('|', '∣')} |"


if __name__ == "__main__":
    FILE.write_text(text())
