"""What the simulated plant may be beyond its nominal description: `PlantSettings`."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, fields

import numpy as np

from robots.errors import InputError

PER_JOINT = ("friction", "damping", "armature", "mass_scale", "inertia_scale", "diagonal_scale")
_MAX = {
    "payload_kg": 1e3,
    "friction": 1e4,
    "damping": 1e4,
    "armature": 1e4,
    "mass_scale": 1e3,
    "inertia_scale": 1e3,
    "diagonal_scale": 10.0,
    "encoder_resolution_deg": 45.0,
    "torque_lag_ms": 1e3,
    "delay_ms": 1e3,
}
# Below, a link is practically massless, or M(q) all but surely indefinite, and the simulation meaningless.
_MIN = {"mass_scale": 1e-3, "inertia_scale": 1e-3, "diagonal_scale": 0.1}


@dataclass(frozen=True)
class PlantSettings:
    """The truth about the plant, which no controller sees. All defaults: the nominal robot.

    payload_kg: kg, a point mass at the robot's tip frame.
    friction: N·m, Coulomb friction per joint (one number or one per joint; N for prismatic joints). MuJoCo
        models it as a soft constraint, so a stuck joint creeps (about 1e-5 rad/s).
    damping: N·m·s/rad, viscous friction. armature: kg·m², reflected rotor inertia, added to M_ii.
    mass_scale: factor on the mass of the body each joint moves. inertia_scale: factor on its rotational
        inertia about its centre of mass, which stays. Both by the same factor: a body of another density.
        The payload is not scaled.
    diagonal_scale: factor on the diagonal entries of M(q) in the dynamics, whatever q, off-diagonal entries,
        C and g left as they are: the literal reading of the HIMPC paper's Table V. No mechanism behaves like
        this: energy is not kept, and below 1 M(q) may lose definiteness (the run then flies apart).
    encoder_resolution_deg: degrees; with a value above 0 the measured position of revolute joints is
        rounded to multiples of it and the measured velocity is their backward difference.
    torque_lag_ms: time constant of a first-order lag of the motors. delay_ms: the command acts this much
        later (to the nearest internal step).
    saturate: clip the command at the robot's torque limits. gravity: switch it off for a weightless plant.

    Raises InputError, naming the field, for values that are not finite, negative or absurdly large.
    """

    payload_kg: float = 0.0
    friction: float | tuple[float, ...] = 0.0
    damping: float | tuple[float, ...] = 0.0
    armature: float | tuple[float, ...] = 0.0
    mass_scale: float | tuple[float, ...] = 1.0
    inertia_scale: float | tuple[float, ...] = 1.0
    diagonal_scale: float | tuple[float, ...] = 1.0
    encoder_resolution_deg: float = 0.0
    torque_lag_ms: float = 0.0
    delay_ms: float = 0.0
    saturate: bool = True
    gravity: bool = True

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if field.name in ("saturate", "gravity"):
                if not isinstance(value, (bool, np.bool_)):
                    raise InputError(f"plant.{field.name} is {value!r}; give true or false.")
                object.__setattr__(self, field.name, bool(value))
            elif field.name in PER_JOINT and isinstance(value, (Sequence, np.ndarray)):
                if isinstance(value, str):
                    raise InputError(
                        f"plant.{field.name} is '{value}'; give a number or one number per joint."
                    )
                checked = tuple(
                    _number(field.name, each) for each in np.ravel(np.asarray(value, dtype=object))
                )
                object.__setattr__(self, field.name, checked)
            else:
                object.__setattr__(self, field.name, _number(field.name, value))

    def per_joint(self, name: str, n: int) -> np.ndarray:
        """(n,) the values of a per-joint field, one number repeated. Raises InputError for a wrong length."""
        value = getattr(self, name)
        if isinstance(value, tuple):
            if len(value) != n:
                raise InputError(
                    f"plant.{name} has {len(value)} values; give one number or one per joint, {n}."
                )
            return np.array(value, dtype=float)
        return np.full(n, float(value))


def _number(name: str, value: object) -> float:
    try:
        if isinstance(value, (bool, str)):
            raise TypeError
        number = float(value)  # pyright: ignore[reportArgumentType]
    except (TypeError, ValueError):
        raise InputError(f"plant.{name} is {value!r}; give a number.") from None
    low = _MIN.get(name, 0.0)
    if not math.isfinite(number) or number < low or number > _MAX[name]:
        raise InputError(f"plant.{name} is {number}; give a finite number from {low:g} to {_MAX[name]:g}.")
    return number
