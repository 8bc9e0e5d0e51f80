"""The choice of a page: a run, and its step in a lesson."""

from __future__ import annotations

from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, final

from app.link.exercise import LessonPlace
from lessons.course import name_of
from lessons.own.files import is_file, is_lesson, read
from lessons.scenes.names import ALL_SCENES
from lessons.scenes.run_spec import RunSpec
from robots.catalog import CATALOG
from robots.errors import InputError

if TYPE_CHECKING:
    from lessons.replay.state import State
    from lessons.scenes.scene import Scene
    from lessons.settings.settings import SceneSettings


@final
@dataclass(frozen=True)
class SceneChoice:
    """A run, with the data that only a page needs.

    Attributes:
        run: scene, robot, settings and seed. For a lesson these are the values of the step, with the step's
            script; the scene is empty until the lesson's file has been read. The controller is an assignment
            in `set`, not in `controller`. Only the paths in `files` are opened.
        urdf_text: the text of a URDF, or the bytes of an upload, a URDF or a zip, which replaces the robot of
            the run.
        exercise: the step of a lesson, if the choice is one.
        mine: the learner's changes to that step, as assignments; they are applied once when the step is
            loaded.
        scenes: Python files that can be chosen as the scene. Of all Python files, only these and the run's
            `files` and `tasks` are executed: the person who started the program named them.
        within: the folder that must contain the URDF and its meshes, if the URDF was named on the page.
    """

    run: RunSpec
    urdf_text: str | bytes | None = None
    exercise: LessonPlace | None = None
    mine: tuple[str, ...] = ()
    scenes: tuple[str, ...] = ()
    within: Path | None = None

    @classmethod
    def starting(
        cls,
        scene: str,
        urdf: str | None = None,
        tip: str | None = None,
        controller: str | None = None,
        tasks: tuple[str, ...] = (),
        hold: tuple[str, ...] = (),
    ) -> SceneChoice:
        """Returns the choice of a command line: scene and controller by name or file path, and files of
        tasks."""
        files = (controller,) if controller is not None and is_file(controller) else ()
        begun = cls.of_run(RunSpec(scene, urdf, tip, controller, files=files, tasks=tasks, hold=hold))
        return replace(begun, scenes=(scene,) if is_file(scene) else ())

    @classmethod
    def opening(cls, lesson: str) -> SceneChoice:
        """Returns the first step of a lesson whose file has not been read yet. Raises InputError for an
        unknown lesson."""
        return cls(RunSpec(""), exercise=LessonPlace(lesson if is_lesson(lesson) else name_of(lesson)))

    @classmethod
    def of_lesson(cls, exercise: LessonPlace) -> SceneChoice:
        """Returns a step of a lesson. Raises InputError for an unknown lesson."""
        exercise = exercise if exercise.text is not None else exercise.opened
        return cls(exercise.run, exercise=exercise)

    @classmethod
    def of_run(cls, run: RunSpec) -> SceneChoice:
        """Returns the start of a run, without the run's script and duration, which a page ignores."""
        run = replace(run, events=None, duration=None)
        if run.controller is None:
            return cls(run)
        from lessons.settings.assignments import assignment

        told = assignment("controller", run.controller)
        return cls(replace(run, controller=None, set=(told, *run.set)))

    @classmethod
    def of_state(cls, state: State) -> SceneChoice:
        """Returns the choice that a state code describes. Raises InputError if the choice cannot be
        loaded."""
        run = state.run
        if state.lesson is None:
            return cls.of_run(run)
        lesson = cls.of_lesson(LessonPlace.at(state.lesson, state.step or 1))
        own = replace(lesson.run, seed=run.seed, files=run.files, tasks=run.tasks)
        if (own.scene, own.urdf, own.tip, own.hold) != (run.scene, run.urdf, run.tip, run.hold):
            raise InputError(
                f"step {state.step or 1} of lesson '{state.lesson}' has another scene than the code: "
                "it was made by another version; open the lesson itself"
            )
        from lessons.settings.assignments import differences

        mine = differences(own.prepared().settings, run.prepared().settings)
        return replace(lesson, run=own, mine=mine)

    def at(self, exercise: LessonPlace) -> SceneChoice:
        """Returns another step of the lesson, with the same seed."""
        step = SceneChoice.of_lesson(exercise)
        return replace(step, run=replace(step.run, seed=self.run.seed)).admitting(self)

    def admitting(self, start: SceneChoice) -> SceneChoice:
        """Returns the same choice, with the files of `start` added."""
        files = _both(start.run.files, self.run.files)
        run = replace(self.run, files=files, tasks=_both(start.run.tasks, self.run.tasks))
        return replace(self, scenes=_both(start.scenes, self.scenes), run=run)

    def with_file(self, path: str) -> SceneChoice:
        """Returns the choice after a user's file was opened by path. The effect depends on the content of the
        file: a lesson or a scene replaces the present one, a controller drives the robot, and a task can then
        be added to the stack.

        Raises:
            InputError: the file cannot be used; the message names the line.
        """
        from lessons.own.load import judged
        from lessons.settings.assignments import assignment

        if is_lesson(path):
            return SceneChoice.opening(path)
        kind = judged(read(path))
        if kind == "scene":
            return SceneChoice.starting(path)
        run = replace(self.run, events=None, duration=None)
        if kind == "task":
            run = replace(run, tasks=_both(run.tasks, (path,)))
        else:
            others = tuple(each for each in run.set if not each.startswith("controller="))
            told = assignment("controller", path)
            run = replace(run, set=(told, *others), files=_both(run.files, (path,)))
        return replace(self, run=run, exercise=None, mine=())

    @property
    def paths(self) -> frozenset[str]:
        """All files of this machine that the choice names."""
        run, lesson = self.run, None if self.exercise is None else self.exercise.lesson
        set_to = (each.partition("=") for each in run.set)
        told = (value.strip().strip('"') for path, _, value in set_to if path == "controller")
        named = (*run.files, *run.tasks, *self.scenes, run.scene, run.controller or "", lesson or "", *told)
        urdf = () if run.urdf is None or run.urdf in CATALOG else (run.urdf,)
        return frozenset((*(name for name in named if is_file(name) or is_lesson(name)), *urdf))

    @property
    def asked(self) -> frozenset[str]:
        """The files that the user named. For a step of a lesson, this is only the lesson's file, which may
        name other files."""
        if self.exercise is None:
            return self.paths
        return frozenset(filter(is_lesson, (self.exercise.lesson,)))

    def without_places(self, sentence: str) -> str:
        """Returns the sentence with file names instead of full paths, so that it reveals no folders of the
        machine."""
        for path in sorted(self.paths, key=len, reverse=True):
            sentence = sentence.replace(path, Path(path).name)
        return sentence

    @property
    def known(self) -> bool:
        """Whether the names in the choice are enough to know that it can be loaded: it contains no file,
        frame or setting of the user's own."""
        scene, seed = self.run.scene, self.run.seed
        if (
            self.run.files
            or self.run.tasks
            or (self.exercise is not None and is_lesson(self.exercise.lesson))
        ):
            return False
        if self.exercise is not None:
            return not scene
        return self == SceneChoice(RunSpec(scene, seed=seed)) and scene in ALL_SCENES and scene != "hold"

    def resolved(self) -> SceneChoice:
        """Returns the same choice; the data of a step of a lesson are completed from the lesson's file.
        Raises InputError if there is no such step."""
        if self.run.scene or self.exercise is None:
            return self
        return self.at(self.exercise)

    def scene(self) -> Scene:
        """Returns the scene with the chosen settings. Raises InputError if it cannot be loaded."""
        choice = self.resolved()
        return choice.run.prepared(choice._bare())

    def fitted(self) -> tuple[SceneChoice, Scene, SceneSettings, tuple[str, ...]]:
        """Returns the choice, the scene, its settings before any assignment, and one reason per omitted task.
        Tasks from files are omitted if the robot cannot have them. A file that was opened for one robot thus
        does not prevent the use of other robots. Raises InputError if the choice cannot be loaded, or if the
        stack names an omitted task."""
        from lessons.runs.named import misfits

        choice = self.resolved()
        bare, run = choice._bare(), choice.run
        out = misfits(bare.robot, run.tasks)
        kept = replace(run, tasks=tuple(each for each in run.tasks if each not in out))
        try:
            scene = kept.prepared(bare)
        except InputError:
            scene = run.prepared(bare)  # raises the error about the task
        own = kept.loaded(bare) if kept.files or kept.tasks else bare
        return replace(choice, run=kept), scene, own.settings, tuple(out.values())

    def _bare(self) -> Scene:
        from lessons.runs.named import scene_named
        from lessons.scenes.catalog import load_scene

        run = self.run
        if self.within is not None:
            from lessons.scenes.hold import hold

            return hold(run.urdf, run.tip, within=self.within, hold=run.hold)
        load = scene_named if self.exercise is not None or run.scene in self.scenes else load_scene
        return load(run.scene, run.urdf, run.tip, self.urdf_text, run.hold)


def _both(one: tuple[str, ...], other: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(dict.fromkeys((*one, *other)))
