"""Writes docs/settings.md from the table of settings: `python -m docs.settings`."""

from __future__ import annotations

from pathlib import Path

from lessons.scenes.catalog import load_scene
from lessons.scenes.names import SCENES, VELOCITY_SCENES
from lessons.settings.listing import SettingLine, reference

FILE = Path(__file__).with_name("settings.md")

_HEAD = """# Settings

What `--set PATH=VALUE` takes, and what the page's controls set. `himpc-lab run SCENE --settings` lists what
one scene has, with its present values. `*` stands for a name: `levels.position.Q` or, by place, `levels.1.Q`.
Where a value may be a list of one number per joint, a place behind the path sets that joint's alone:
`M_bar.3=0.05`; `gains.2=0.4` does so for a level's gain. `obstacles.NAME=[x,y,z,radius]` adds a ball,
`obstacles.NAME=null` takes it away.

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
