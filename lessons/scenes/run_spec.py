"""A run as data, which the command line, lessons, jobs, state codes and the page use."""

from __future__ import annotations

import shlex
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, final

if TYPE_CHECKING:
    from lessons.events import Event
    from lessons.scenes.scene import Scene


@final
@dataclass(frozen=True)
class RunSpec:
    """A run: hashable, and sent to another process as it is.

    Attributes:
        scene: name of a scene, or the path of a file that makes one.
        urdf: for the scene "hold": name of a catalog robot, or path of a URDF file.
        tip: end-effector frame, for the scene "hold".
        controller: name or path of a file; None: the scene's own, or the one that `set` names.
        set: assignments "PATH=VALUE" as of `himpc-lab run --set`, in order.
        events: (time in s, event) in order; None: the scene's own.
        duration: simulated seconds; None: the scene's own.
        seed: seed of the run.
        files: Python files that may be the controller; whoever started the program named them.
        tasks: Python files whose tasks the stack may name, likewise.
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

    def loaded(self) -> Scene:
        """The scene without controller and assignments. Raises InputError if it cannot be loaded."""
        from lessons.runs.named import scene_named, with_tasks
        from lessons.scenes.catalog import with_controllers

        scene = with_controllers(scene_named(self.scene, self.urdf, self.tip), self.files)
        return with_tasks(scene, self.tasks)

    def prepared(self) -> Scene:
        """The scene with everything in place but the seed. Raises InputError with one sentence for an invalid
        run.
        """
        return self.applied_to(self.loaded())

    def applied_to(self, scene: Scene) -> Scene:
        """The scene, however it was loaded, with all that the run says besides."""
        from lessons.runs.named import with_tasks
        from lessons.scenes.catalog import prepared, with_controllers

        scene = with_tasks(with_controllers(scene, self.files), self.tasks)
        scene = prepared(scene, self.controller, self.set)
        if self.events is not None:
            scene = replace(scene, events=self.events)
        return scene if self.duration is None else replace(scene, duration=self.duration)

    def but(self, *assignments: str) -> RunSpec:
        """The same run with further assignments."""
        return replace(self, set=(*self.set, *assignments))

    def command_line(self) -> str:
        """The line for a shell that does it; events cannot be told there."""
        controller, assignments = self.controller, list(self.set)
        if controller is None and assignments and assignments[0].startswith("controller="):
            controller = assignments.pop(0).partition("=")[2]
        words = ["himpc-lab", "run", self.scene]
        for name, value in (("urdf", self.urdf), ("tip", self.tip), ("controller", controller)):
            words += [f"--{name}", value] if value is not None else []
        for each in self.tasks:
            words += ["--task", each]
        words += ["--duration", f"{self.duration:g}"] if self.duration is not None else []
        words += ["--seed", str(self.seed)] if self.seed else []
        for each in assignments:
            words += ["--set", each]
        return shlex.join(words)
