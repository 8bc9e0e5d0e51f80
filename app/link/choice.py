"""What a page shows: a scene, a robot and settings, or the step of a lesson."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from app.link.exercise import Exercise
from lessons.course import COURSE
from lessons.own.files import is_file
from lessons.scenes.names import ALL_SCENES
from lessons.scenes.run_spec import RunSpec
from lessons.settings.assignments import assignment
from robots.errors import InputError, unknown_name

if TYPE_CHECKING:
    from lessons.replay.state import State
    from lessons.scenes.scene import Scene


@dataclass(frozen=True)
class SceneChoice:
    """Which scene to load, for `hold` which robot, and with which settings and seed: assignments
    "PATH=VALUE" on top of the scene's own. The step of a lesson brings all of it, and its script; `mine` is
    what the learner had changed of it, made anew once when it is loaded. `scenes` and `controllers` are the
    Python files that whoever started the program named: no others are run."""

    name: str
    urdf: str | None = None
    tip: str | None = None
    urdf_text: str | None = None
    set: tuple[str, ...] = ()
    seed: int = 0
    exercise: Exercise | None = None
    mine: tuple[str, ...] = ()
    scenes: tuple[str, ...] = ()
    controllers: tuple[str, ...] = ()

    @classmethod
    def starting(
        cls, scene: str, urdf: str | None = None, tip: str | None = None, controller: str | None = None
    ) -> SceneChoice:
        """What the command line asks for: scene and controller by name, or by the path of a file."""
        return cls(
            scene,
            urdf,
            tip,
            set=() if controller is None else (assignment("controller", controller),),
            scenes=(scene,) if is_file(scene) else (),
            controllers=(controller,) if controller is not None and is_file(controller) else (),
        )

    def admitting(self, start: SceneChoice) -> SceneChoice:
        """The same with the files of what the program was started with."""
        return replace(self, scenes=start.scenes, controllers=start.controllers)

    @classmethod
    def opening(cls, lesson: str) -> SceneChoice:
        """The first step of a lesson whose file is not read yet. Raises InputError if there is no such
        lesson."""
        if lesson not in COURSE and not is_file(lesson):
            raise unknown_name("lesson", lesson, COURSE)
        return cls("", exercise=Exercise(lesson))

    @classmethod
    def of_lesson(cls, exercise: Exercise) -> SceneChoice:
        """A step of a lesson. Raises InputError if there is no such lesson."""
        run = exercise.run
        return cls(run.scene, run.urdf, set=run.set, exercise=exercise)

    @classmethod
    def of_run(cls, run: RunSpec) -> SceneChoice:
        """What a run begins with; a page has no script and no end."""
        told = () if run.controller is None else (f"controller={run.controller}",)
        return cls(run.scene, run.urdf, run.tip, set=(*told, *run.set), seed=run.seed)

    @property
    def run(self) -> RunSpec:
        """What it loads, but for an uploaded robot. Raises InputError if a lesson is named that is none."""
        if self.exercise is not None:
            return replace(self.exercise.run, seed=self.seed, files=self.controllers)
        return RunSpec(self.name, self.urdf, self.tip, set=self.set, seed=self.seed, files=self.controllers)

    @classmethod
    def of_state(cls, state: State) -> SceneChoice:
        """What a state code holds. Raises InputError for what cannot be loaded."""
        if state.lesson is None:
            return cls.of_run(state.run)
        exercise = Exercise.at(state.lesson, state.step or 1)
        lesson = cls.of_lesson(exercise)
        run = state.run
        if (lesson.name, lesson.urdf, lesson.tip) != (run.scene, run.urdf, run.tip):
            raise InputError(
                f"step {state.step or 1} of lesson '{state.lesson}' has another scene than the code: "
                "it was made by another version; open the lesson itself"
            )
        from lessons.own.resolve import with_controllers
        from lessons.settings.assignments import differences

        mine = differences(
            with_controllers(exercise.run.prepared(), run.files).settings, run.prepared().settings
        )
        return replace(lesson, seed=run.seed, mine=mine)

    @property
    def known(self) -> bool:
        """Whether names alone tell that it can be loaded: no file, frame or setting of somebody's own."""
        if self.controllers or (self.exercise is not None and is_file(self.exercise.lesson)):
            return False
        if self.exercise is not None:
            return not self.name
        return (
            self == SceneChoice(self.name, seed=self.seed) and self.name in ALL_SCENES and self.name != "hold"
        )

    def resolved(self) -> SceneChoice:
        """The same, with what a lesson's file says about its step. Raises InputError if there is none."""
        if self.name or self.exercise is None:
            return self
        return SceneChoice.of_lesson(self.exercise).admitting(self)

    def scene(self) -> Scene:
        """The scene with the settings chosen. Raises InputError for what cannot be loaded."""
        from lessons.own.resolve import scene_named, with_controllers
        from lessons.scenes.catalog import load_scene, prepared

        if self.exercise is not None:
            return with_controllers(self.exercise.run.prepared(), self.controllers)
        load = scene_named if self.name in self.scenes else load_scene
        scene = with_controllers(load(self.name, self.urdf, self.tip, self.urdf_text), self.controllers)
        return prepared(scene, None, self.set)
