"""`PlantSettings`: the differences between the simulated plant and its nominal description."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields
from typing import Annotated

import numpy as np

from robots.errors import InputError
from robots.ranges import Range, Shown, check_fields

PerJoint = float | tuple[float, ...]
"""One number for all joints, or one per joint."""


@dataclass(frozen=True)
class PlantSettings:
    """Parameters of the plant, which controllers do not use. The defaults describe the nominal robot.

    Attributes:
        payload_kg: kg, a point mass at the robot's tip frame.
        friction: N·m, Coulomb friction per joint (one number or one per joint; N for prismatic joints).
            MuJoCo models friction as a soft constraint: a joint that should stick moves very slowly.
        armature: kg·m², reflected rotor inertia, added to M_ii; 0: the one that the import of the robot's
            URDF assumed (0 for the robots of the catalog).
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
        delay_ms: ms, delay of the command (rounded to the nearest internal step).

    Raises InputError, which names the field, for values that are not finite, negative or extremely large.
    """

    # fmt: off
    payload_kg: Annotated[float, Range(0.0, 1e3), Shown(
        "Payload", "A mass at the hand that the controller does not know", "kg", 0.0, 10.0, 0.1,
        tries=("3", "1", "2", "5", "0"), name="payload, kg", group="Plant")] = 0.0
    friction: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Coulomb friction", "Coulomb friction of every joint", "N·m", 0.0, 10.0, 0.1, group="Plant")] = 0.0
    damping: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Viscous friction", "Viscous friction of every joint", "N·m·s/rad", 0.0, 10.0, 0.1, group="Plant",
    )] = 0.0
    armature: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Armature", "Reflected inertia of the motors", "kg·m²", 0.0, 1.0, 0.01, group="Plant")] = 0.0
    # With smaller factors, a link has practically no mass or M(q) is almost certainly indefinite. The
    # simulation would then be meaningless.
    mass_scale: Annotated[PerJoint, Range(1e-3, 1e3), Shown(
        "Mass scale", "Factor on the mass of every link", "", 0.2, 3.0, 0.05, group="Plant")] = 1.0
    inertia_scale: Annotated[PerJoint, Range(1e-3, 1e3), Shown(
        "Inertia scale", "Factor on the rotational inertia of every link", "", 0.2, 3.0, 0.05,
        tries=("0.8", "1.2", "1"), name="true inertias ×", group="Plant")] = 1.0
    diagonal_scale: Annotated[PerJoint, Range(0.1, 10.0), Shown(
        "M(q) diagonal scale", "Factor on the diagonal of M(q) alone, as the text of the paper's Table V "
        "says; no real arm has this property", "", 0.5, 2.0, 0.05, group="Plant")] = 1.0
    encoder_resolution_deg: Annotated[float, Range(0.0, 45.0), Shown(
        "Encoder", "Resolution of the joint sensors; 0: ideal sensors", "°", 0.0, 20.0, 0.25,
        page_unit="10⁻³ °", factor=1000.0, tries=("0.005", "0.001", "0.01", "0"),
        name="encoder resolution, °", group="Plant")] = 0.0
    torque_lag_ms: Annotated[float, Range(0.0, 1e3), Shown(
        "Torque lag", "First-order lag of the motors", "ms", 0.0, 20.0, 0.5, group="Plant")] = 0.0
    delay_ms: Annotated[float, Range(0.0, 1e3), Shown(
        "Delay", "Time from command to torque", "ms", 0.0, 10.0, 0.5, tries=("1", "2", "0"),
        name="delay of the command, ms", group="Plant")] = 0.0
    saturate: Annotated[bool, Shown(
        "Motors saturate", "Clip the torque at the limits of the data sheet", tries=("false", "true"),
        name="torque bound of the motors", group="Plant")] = True
    gravity: Annotated[bool, Shown("Gravity", "Whether gravity acts on the plant", group="Plant")] = True
    contacts: Annotated[bool, Shown(
        "Contacts", "The robot touches itself and the objects around it. If switched off, it passes through "
        "them", tries=("false", "true"), name="contacts", group="Plant")] = False
    joint_stops: Annotated[bool, Shown(
        "Joint stops", "A joint that is pushed to its limit stops there. If switched off, it moves on",
        group="Plant")] = False
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self, "plant.")
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
