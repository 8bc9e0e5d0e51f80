"""What a page shows: a scene, a robot and settings, or the step of a lesson."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

from app.link.exercise import Exercise
from lessons.course import COURSE
from lessons.scenes.names import ALL_SCENES
from robots.errors import InputError, unknown_name

if TYPE_CHECKING:
    from lessons.replay.state import State
    from lessons.scenes.scene import Scene


@dataclass(frozen=True)
class SceneChoice:
    """Which scene to load, for `hold` which robot, and with which settings and seed: assignments
    "PATH=VALUE" on top of the scene's own. The step of a lesson brings all of it, and its script; `mine` is
    what the learner had changed of it, made anew once when it is loaded."""

    name: str
    urdf: str | None = None
    tip: str | None = None
    urdf_text: str | None = None
    set: tuple[str, ...] = ()
    seed: int = 0
    exercise: Exercise | None = None
    mine: tuple[str, ...] = ()

    @classmethod
    def opening(cls, lesson: str) -> SceneChoice:
        """The first step of a lesson whose file is not read yet. Raises InputError if there is no such
        lesson."""
        if lesson not in COURSE:
            raise unknown_name("lesson", lesson, COURSE)
        return cls("", exercise=Exercise(lesson))

    @classmethod
    def of_lesson(cls, exercise: Exercise) -> SceneChoice:
        """A step of a lesson. Raises InputError if there is no such lesson."""
        run = exercise.run
        return cls(run.scene, run.urdf, set=run.set, exercise=exercise)

    @classmethod
    def of_state(cls, state: State) -> SceneChoice:
        """What a state code holds. Raises InputError for what cannot be loaded."""
        if state.lesson is None:
            return cls(state.scene, state.urdf, state.tip, set=state.set, seed=state.seed)
        exercise = Exercise.at(state.lesson, state.step or 1)
        lesson = cls.of_lesson(exercise)
        if (lesson.name, lesson.urdf, lesson.tip) != (state.scene, state.urdf, state.tip):
            raise InputError(
                f"step {state.step or 1} of lesson '{state.lesson}' has another scene than the code: "
                "it was made by another version; open the lesson itself"
            )
        from lessons.settings.assignments import differences

        mine = differences(exercise.run.prepared().settings, state.prepared().settings)
        return replace(lesson, seed=state.seed, mine=mine)

    @property
    def known(self) -> bool:
        """Whether names alone tell that it can be loaded: no file, frame or setting of somebody's own."""
        if self.exercise is not None:
            return not self.name
        return (
            self == SceneChoice(self.name, seed=self.seed) and self.name in ALL_SCENES and self.name != "hold"
        )

    def resolved(self) -> SceneChoice:
        """The same, with what a lesson's file says about its step. Raises InputError if there is none."""
        return self if self.name or self.exercise is None else SceneChoice.of_lesson(self.exercise)

    def scene(self) -> Scene:
        """The scene with the settings chosen. Raises InputError for what cannot be loaded."""
        if self.exercise is not None:
            return self.exercise.run.prepared()
        from lessons.scenes.catalog import load_scene, prepared

        return prepared(load_scene(self.name, self.urdf, self.tip, self.urdf_text), None, self.set)
