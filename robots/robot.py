"""`Robot`: the description of a robot that the rest of the project uses. It contains nothing about
control."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np
import pinocchio as pin

from robots.errors import InputError, unknown_name
from robots.geometry import CollisionModel, Cover, Shape
from robots.joints import own_joints
from robots.report import ImportReport

_MODEL = ("armature", "effortLimit", "velocityLimit", "lowerPositionLimit", "upperPositionLimit")
"""What an import may change in the model of a canonical description."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A fixed-base robot whose joints all have one degree of freedom. It has n joints with a coordinate each
    (nq = nv = n), and joints that follow (mimic) one of these.

    All vectors are in Pinocchio's joint order, and all frames are URDF links. Units are SI: rad for angles, m
    for prismatic joints. The arrays are read-only; `dataclasses.replace` creates a changed robot. A robot can
    be pickled and sent to a spawned child process.
    """

    name: str
    model: pin.Model
    joint_names: tuple[str, ...]  # (n,)
    tip: str  # default frame of tasks
    home: np.ndarray  # (n,) rad, inside the limits
    q_lower: np.ndarray  # (n,) rad, −inf where unbounded
    q_upper: np.ndarray  # (n,) rad, +inf where unbounded
    v_limit: np.ndarray  # (n,) rad/s
    tau_limit: np.ndarray  # (n,) N·m
    a_max: np.ndarray  # (n,) rad/s², deceleration that the viability bound assumes
    M_bar: np.ndarray  # (n,) kg·m², suggested diagonal of M̄
    urdf_text: str  # canonical URDF
    report: ImportReport
    collision: CollisionModel = field(default_factory=CollisionModel)  # solids, and excluded pairs
    cover: Cover | None = None  # made by `cover_of` if it is None
    surfaces: tuple[Shape, ...] = ()  # what is drawn, if the files of the meshes are gone

    def __post_init__(self) -> None:
        for name in ("home", "q_lower", "q_upper", "v_limit", "tau_limit", "a_max", "M_bar"):
            values = np.array(getattr(self, name), dtype=float)
            if values.shape != (self.model.nv,):
                raise ValueError(f"Robot.{name} has shape {values.shape}, expected ({self.model.nv},)")
            values.flags.writeable = False
            object.__setattr__(self, name, values)

    @cached_property
    def n(self) -> int:
        """Number of joints that do not follow others."""
        return self.model.nv

    @cached_property
    def joints(self) -> tuple[int, ...]:
        """Pinocchio indices of the joints that do not follow others, (n,)."""
        return own_joints(self.model)

    @cached_property
    def _frame_ids(self) -> dict[str, int]:
        bodies = (i for i, frame in enumerate(self.model.frames) if frame.type == pin.FrameType.BODY)
        return {self.model.frames[i].name: i for i in bodies}

    @property
    def frames(self) -> tuple[str, ...]:
        """Names of the frames that tasks and plants may use: the links of the URDF, root first."""
        return tuple(self._frame_ids)

    def frame_id(self, name: str) -> int:
        """Returns the index of a frame in `model.frames`.

        For a name that is not a link, it raises InputError with the most similar name and the full list.
        """
        try:
            return self._frame_ids[name]
        except KeyError:
            raise unknown_name(f"frame of robot '{self.name}' called", name, self.frames) from None

    def moving_body(self, name: str) -> int:
        """Returns the Pinocchio index of the joint that moves a body. `name` is that of the joint or of
        any frame on the body.

        Raises InputError for an unknown name and for a frame that is fixed to the world.
        """
        joints = list(self.model.names)
        if name in joints[1:]:
            return joints.index(name)
        if name not in self._frame_ids:
            raise unknown_name(f"body of robot '{self.name}' called", name, (*self.frames, *self.joint_names))
        joint = self.model.frames[self._frame_ids[name]].parentJoint
        if joint == 0:
            moving = (f for f, i in self._frame_ids.items() if self.model.frames[i].parentJoint > 0)
            raise InputError(
                f"'{name}' is fixed to the world: choose a moving body, such as '{next(moving)}'."
            )
        return joint

    def __getstate__(self) -> dict[str, Any]:
        state = dict(self.__dict__)
        if self.model.njoints - 1 > self.n:
            # Pinocchio cannot store joints that follow others: their model is read again.
            state["model"] = {name: getattr(self.model, name).copy() for name in _MODEL}
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        if isinstance(state["model"], dict):
            from robots.urdf.canonical import canonical_model  # the files of this folder import this file

            model = canonical_model(state["urdf_text"])
            for name, values in state["model"].items():
                setattr(model, name, values)
            state = {**state, "model": model}
        self.__dict__.update(state)

    def __repr__(self) -> str:
        return f"Robot({self.name!r}, n={self.n}, tip={self.tip!r})"
