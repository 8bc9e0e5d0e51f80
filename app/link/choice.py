"""What a page shows: a scene, a robot and settings, or the step of a lesson."""

from __future__ import annotations

from dataclasses import dataclass, replace

from app.link.exercise import Exercise
from lessons.replay.state import State
from lessons.scenes.catalog import load_scene, prepared
from lessons.scenes.scene import Scene
from lessons.settings.assignments import differences
from robots import InputError


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
        mine = differences(exercise.run.prepared().settings, state.prepared().settings)
        return replace(lesson, seed=state.seed, mine=mine)

    def scene(self) -> Scene:
        """The scene with the settings chosen. Raises InputError for what cannot be loaded."""
        if self.exercise is not None:
            return self.exercise.run.prepared()
        return prepared(load_scene(self.name, self.urdf, self.tip, self.urdf_text), None, self.set)
