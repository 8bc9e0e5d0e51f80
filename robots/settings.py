"""`PlantSettings`: the differences between the simulated plant and its nominal description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from robots.errors import InputError
from robots.ranges import Range, check_fields

PerJoint = float | tuple[float, ...]
"""One number for all joints, or one per joint."""


@dataclass(frozen=True)
class PlantSettings:
    """Parameters of the plant, which controllers do not use. The defaults describe the nominal robot.

    Attributes:
        payload_kg: kg, a point mass at the robot's tip frame.
        friction: N·m, Coulomb friction per joint (one number or one per joint; N for prismatic joints).
            MuJoCo models it as a soft constraint: a stuck joint creeps a little.
        damping: N·m·s/rad, viscous friction.
        armature: kg·m², reflected rotor inertia, added to M_ii.
        mass_scale: factor on the mass of the body each joint moves.
        inertia_scale: factor on its rotational inertia about its centre of mass, whose position is not
            changed. The same value for both factors describes a body of another density. The payload is not
            scaled.
        diagonal_scale: factor on the diagonal entries of M(q) in the dynamics at every q, with off-diagonal
            entries, C and g unchanged: the literal reading of the HIMPC paper's Table V. No mechanism behaves
            like this: energy is not conserved, and below 1 M(q) may become indefinite (the simulation then
            diverges).
        encoder_resolution_deg: degrees; with a value above 0 the measured position of revolute joints is
            rounded to multiples of it and the measured velocity is their backward difference.
        torque_lag_ms: ms, time constant of a first-order lag of the motors.
        delay_ms: ms, delay of the command (rounded to the nearest internal step).
        saturate: whether the command is clipped at the robot's torque limits.
        gravity: whether gravity acts on the plant.
        contacts: whether the robot touches itself and the objects of its world; otherwise everything passes
            through everything.
        joint_stops: whether a joint stops at its limits; otherwise it moves on.

    Raises InputError, naming the field, for values that are not finite, negative or absurdly large.
    """

    payload_kg: Annotated[float, Range(0.0, 1e3)] = 0.0
    friction: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    damping: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    armature: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    # With smaller factors a link has practically no mass, or M(q) is almost certainly indefinite, and the
    # simulation is meaningless.
    mass_scale: Annotated[PerJoint, Range(1e-3, 1e3)] = 1.0
    inertia_scale: Annotated[PerJoint, Range(1e-3, 1e3)] = 1.0
    diagonal_scale: Annotated[PerJoint, Range(0.1, 10.0)] = 1.0
    encoder_resolution_deg: Annotated[float, Range(0.0, 45.0)] = 0.0
    torque_lag_ms: Annotated[float, Range(0.0, 1e3)] = 0.0
    delay_ms: Annotated[float, Range(0.0, 1e3)] = 0.0
    saturate: bool = True
    gravity: bool = True
    contacts: bool = False
    joint_stops: bool = False

    def __post_init__(self) -> None:
        check_fields(self, "plant.")
        for name in ("saturate", "gravity", "contacts", "joint_stops"):
            if not isinstance(getattr(self, name), (bool, np.bool_)):
                raise InputError(f"plant.{name} is {getattr(self, name)!r}; give true or false.")
        # NumPy arrays and numbers become plain Python ones: settings are compared and written as text.
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, (Sequence, np.ndarray)):
                value = tuple(float(each) for each in value)
            plain_value = value if isinstance(value, tuple) else type(field.default)(value)
            object.__setattr__(self, field.name, plain_value)

    def per_joint(self, name: str, n: int) -> np.ndarray:
        """Returns the values (n,) of a per-joint field; a single number is repeated. Raises InputError for a
        wrong length."""
        value = getattr(self, name)
        if isinstance(value, tuple):
            if len(value) != n:
                raise InputError(
                    f"plant.{name} has {len(value)} values; give one number or one per joint, {n}."
                )
            return np.array(value, dtype=float)
        return np.full(n, float(value))
