"""The kinds of tasks, by their names in settings and menus."""

from __future__ import annotations

from dataclasses import dataclass

from himpc.tasks.centre_of_mass import CentreOfMass
from himpc.tasks.frame_orientation import FrameOrientation
from himpc.tasks.frame_position import FramePosition
from himpc.tasks.joints import Damping, Joints, Posture
from himpc.tasks.plane_distance import PlaneDistance
from himpc.tasks.pointing import Pointing
from himpc.tasks.relative import RelativeOrientation, RelativePosition
from himpc.tasks.task import Task


@dataclass(frozen=True)
class Kind:
    """A kind of task.

    Attributes:
        says: description in one line.
        makes: task classes of the kind; several classes create tasks of equal priority, named NAME_SUFFIX.
        suffixes: the suffix of each task's name; empty for a kind with one class.
    """

    says: str
    makes: tuple[type[Task], ...]
    suffixes: tuple[str, ...] = ("",)


_BOTH = ("_position", "_orientation")

KINDS: dict[str, Kind] = {
    "position": Kind("the position of a frame's origin in the world", (FramePosition,)),
    "orientation": Kind("the orientation of a frame in the world", (FrameOrientation,)),
    "pose": Kind(
        "position and orientation of a frame in the world, with equal priority",
        (FramePosition, FrameOrientation),
        _BOTH,
    ),
    "joints": Kind("the positions of some joints", (Joints,)),
    "posture": Kind("the positions of all joints", (Posture,)),
    "damping": Kind("all joints come to rest, at any position", (Damping,)),
    "com": Kind("the centre of mass of all moving links", (CentreOfMass,)),
    "relative_position": Kind("the position of a frame relative to another frame", (RelativePosition,)),
    "relative_orientation": Kind(
        "the orientation of a frame relative to another frame", (RelativeOrientation,)
    ),
    "relative_pose": Kind(
        "position and orientation of a frame relative to another frame, with equal priority",
        (RelativePosition, RelativeOrientation),
        _BOTH,
    ),
    "pointing": Kind("an axis of a frame points at a point", (Pointing,)),
    "plane_distance": Kind("a frame's distance from a plane", (PlaneDistance,)),
}
"""All kinds of tasks. A kind that exists in Pink and Mink too has the same name as there (frame, com,
relative frame, posture, damping)."""


OWN = "own"
"""Name of the kind of tasks that are not built in."""


def kind_name(task: Task) -> str:
    """Returns the name of a task's kind, or OWN for a class that is not built in."""
    return _WORDS.get(type(task), OWN)


def description(task: Task) -> str:
    """Returns a description of a task in one line."""
    word = kind_name(task)
    return KINDS[word].says if word != OWN else (type(task).__doc__ or "a task of your own").split("\n")[0]


_WORDS: dict[type[Task], str] = {kind.makes[0]: word for word, kind in KINDS.items() if len(kind.makes) == 1}
