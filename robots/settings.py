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
            MuJoCo models friction as a soft constraint: a joint that should stick moves very slowly.
        damping: N·m·s/rad, viscous friction.
        armature: kg·m², reflected rotor inertia, added to M_ii; 0: the one that the import of the robot's
            URDF assumed (0 for the robots of the catalog).
        mass_scale: factor on the mass of the body that each joint moves.
        inertia_scale: factor on the rotational inertia of this body about its centre of mass, whose position
            is not changed. If both factors are equal, the body has another density. The payload is not
            scaled.
        diagonal_scale: factor on the diagonal entries of M(q) in the dynamics at every q. Off-diagonal
            entries, C and g are unchanged: the literal reading of the HIMPC paper's Table V. No real
            mechanism has such dynamics: energy is not conserved, and with factors below 1 M(q) may become
            indefinite (the simulation then diverges).
        encoder_resolution_deg: degrees. With a value above 0, the measured position of a revolute joint is
            rounded to multiples of the resolution, and the measured velocity is the backward difference of
            these positions.
        torque_lag_ms: ms, time constant of a first-order lag of the motors.
        delay_ms: ms, delay of the command (rounded to the nearest internal step).
        saturate: whether the command is clipped at the robot's torque limits.
        gravity: whether gravity acts on the plant.
        contacts: whether the robot touches itself and the objects of its world; otherwise they pass through
            each other.
        joint_stops: whether a joint stops at its limits; otherwise it continues to move.

    Raises InputError, which names the field, for values that are not finite, negative or extremely large.
    """

    payload_kg: Annotated[float, Range(0.0, 1e3)] = 0.0
    friction: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    damping: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    armature: Annotated[PerJoint, Range(0.0, 1e4)] = 0.0
    # With smaller factors, a link has practically no mass or M(q) is almost certainly indefinite. The
    # simulation would then be meaningless.
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
        # NumPy arrays and numbers become plain Python numbers: settings are compared and written as text.
        for field in fields(self):
            value = getattr(self, field.name)
            if isinstance(value, (Sequence, np.ndarray)):
                value = tuple(float(each) for each in value)
            plain_value = value if isinstance(value, tuple) else type(field.default)(value)
            object.__setattr__(self, field.name, plain_value)

    def per_joint(self, name: str, n: int) -> np.ndarray:
        """Returns the values (n,) of a per-joint field. A single number is repeated. Raises InputError for a
        wrong length."""
        return per_joint(f"plant.{name}", getattr(self, name), n)


def per_joint(name: str, value: PerJoint, n: int) -> np.ndarray:
    """Returns values (n,); a single number is repeated. Raises InputError with the name for a wrong size."""
    if not isinstance(value, tuple):
        return np.full(n, float(value))
    if len(value) != n:
        raise InputError(f"{name} has {len(value)} values; give one number or one per joint, {n}.")
    return np.array(value, dtype=float)
