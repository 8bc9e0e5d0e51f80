"""The setting of a page as a state."""

from __future__ import annotations

from app.link.choice import SceneChoice
from app.link.messages import RunDescription
from lessons.replay.state import State, state_of
from robots import InputError


def state_now(told: RunDescription) -> State:
    """Returns the state of the setting on a page. Raises InputError for a robot that was uploaded."""
    choice = refuse_uploaded_robot(told.choice)
    exercise = choice.exercise
    return state_of(
        choice.run,
        told.settings,
        lesson=None if exercise is None else exercise.lesson,
        step=None if exercise is None else exercise.place + 1,
    )


def refuse_uploaded_robot(choice: SceneChoice) -> SceneChoice:
    """Returns the choice unchanged. Raises InputError if its robot was uploaded."""
    if choice.urdf_text is not None:
        raise InputError(
            "a code cannot contain this robot, which was uploaded: save its file and "
            "start himpc-lab with --urdf"
        )
    return choice
