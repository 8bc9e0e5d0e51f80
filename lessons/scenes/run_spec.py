"""A run as data, which the command line, lessons, jobs, state codes and the page use."""

from __future__ import annotations

import json
import re
import shlex
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

from robots.errors import InputError

if TYPE_CHECKING:
    from lessons.events import Event
    from lessons.scenes.scene import Scene

AS_PRINTED = ("avoidance.on=false", "limits.stall_guard=false")
"""The assignments that switch off what scenes have by default and the papers do not print."""

MAX_SEED = 2**63 - 1
_TASK_FILE = re.compile(r'"task"\s*:\s*("(?:[^"\\]|\\.)*\.py")')
"""Pattern for a task in a stack, as JSON, that is named by the path of its file."""


@final
@dataclass(frozen=True)
class RunSpec:
    """A run; it is hashable and can be sent to another process.

    Attributes:
        scene: name of a scene, or path of a file that creates a scene.
        urdf: for the scene "hold": name of a catalog robot, or path of a URDF file.
        tip: end-effector frame, for the scene "hold"; with a tool as of `robots.load_robot`.
        controller: name of a controller, or path of a file; None: the controller that `set` names, or that of
            the scene.
        set: assignments "PATH=VALUE" as of `himpc-lab run --set`, in order.
        events: (time in s, event) in order; None: the scene's own.
        duration: simulated seconds; None: the scene's own.
        seed: seed of the run, from 0 to MAX_SEED.
        files: Python files that can be selected as the controller, named by the person who started the
            program.
        tasks: Python files whose tasks the stack can name; the same person has named these files.
        hold: patterns of joints that are held, for the scene "hold", as of `robots.load_robot`.
    """

    scene: str
    urdf: str | None = None
    tip: str | None = None
    controller: str | None = None
    set: tuple[str, ...] = ()
    events: tuple[tuple[float, Event], ...] | None = None
    duration: float | None = None
    seed: int = 0
    files: tuple[str, ...] = ()
    tasks: tuple[str, ...] = ()
    hold: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        check_seed(self.seed)

    def loaded(self, bare: Scene | None = None) -> Scene:
        """Returns the scene with the run's files attached, without controller and assignments. Raises
        InputError if the scene cannot be loaded.

        bare: the scene without the files, if it is loaded already.
        """
        from lessons.runs.named import scene_named, with_files

        scene = scene_named(self.scene, self.urdf, self.tip, hold=self.hold) if bare is None else bare
        return with_files(scene, self.files, self.tasks)

    def prepared(self, bare: Scene | None = None) -> Scene:
        """Returns the scene with controller, assignments, events and duration of the run. Raises InputError
        with one sentence for an invalid run. bare: as for `loaded`.
        """
        from lessons.scenes.catalog import prepared

        scene = prepared(self.loaded(bare), self.controller, self.set)
        if self.events is not None:
            scene = replace(scene, events=self.events)
        return scene if self.duration is None else replace(scene, duration=self.duration)

    def but(self, *assignments: str) -> RunSpec:
        """Returns the same run with further assignments."""
        return replace(self, set=(*self.set, *assignments))

    def admitting(self, *assignments: str) -> RunSpec:
        """Returns the same run with further assignments by the person who started the program: the Python
        files that the stacks in these assignments name are admitted as tasks."""
        stacks = (text for text in assignments if text.startswith(("stack=", "stack.add=")))
        words = (word for text in stacks for word in _TASK_FILE.findall(text))
        return replace(self.but(*assignments), tasks=(*self.tasks, *dict.fromkeys(map(_unquoted, words))))

    def command_line(self) -> str:
        """Returns the command for a shell that repeats the run without its events."""
        controller, assignments = self.controller, list(self.set)
        if controller is None and assignments and assignments[0].startswith("controller="):
            controller = assignments.pop(0).partition("=")[2]
        words = ["himpc-lab", "run", self.scene]
        for name, value in (("urdf", self.urdf), ("tip", self.tip), ("controller", controller)):
            words += [f"--{name}", value] if value is not None else []
        for name, values in (("hold", self.hold), ("task", self.tasks)):
            words += [word for value in values for word in (f"--{name}", value)]
        words += (
            ["--duration", repr(float(self.duration)).removesuffix(".0")] if self.duration is not None else []
        )
        words += ["--seed", str(self.seed)] if self.seed else []
        for assignment in assignments:
            words += ["--set", assignment]
        return shlex.join(words)


def tip_with_tool(tip: str | None, tool: str | None) -> str | None:
    """Returns the tip of a run whose tip carries a tool at x,y,z or x,y,z,roll,pitch,yaw, m and rad."""
    if tool is None:
        return tip
    from robots.urdf.tip import TOOL  # late, as it loads a reader of XML

    return f"{tip or ''}{TOOL}{tool}"


def check_seed(seed: int) -> None:
    """Raises InputError if a seed is outside the range of seeds."""
    if not 0 <= seed <= MAX_SEED:
        raise InputError(f"seed is {seed}: give a whole number from 0 to {MAX_SEED}")


def _unquoted(word: str) -> str:
    """Returns the text of a JSON string. Other texts are returned unchanged, and `read_stack` refuses
    them."""
    try:
        return json.loads(word)
    except ValueError:
        return word
