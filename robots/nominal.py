"""The nominal dynamic model of model-based controllers: the robot's model with specified modelling errors."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

import numpy as np
import pinocchio as pin

from robots.arrays import Array
from robots.inertia import mass_matrix
from robots.ranges import Range, Shown, check_fields
from robots.robot import Robot
from robots.settings import PerJoint, PlantSettings, per_joint
from robots.truth import true_model

_BELIEVED = "Value in the nominal model, which model-based controllers use"


@dataclass(frozen=True)
class NominalSettings:
    """Parameters of the nominal model of a model-based controller; `PlantSettings` describes the plant
    separately.

    payload_kg, damping, armature, mass_scale, inertia_scale, gravity: as in `PlantSettings`, but for the
    nominal model. The defaults describe the robot of the URDF, without armature and friction.

    Raises InputError, which names the field, for values that are not allowed.
    """

    # fmt: off
    payload_kg: Annotated[float, Range(0.0, 1e3), Shown(
        "Believed payload", _BELIEVED, "kg", 0.0, 10.0, 0.1)] = 0.0
    damping: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Believed viscous friction", _BELIEVED, "N·m·s/rad", 0.0, 10.0, 0.1)] = 0.0
    armature: Annotated[PerJoint, Range(0.0, 1e4), Shown(
        "Believed armature", _BELIEVED, "kg·m²", 0.0, 1.0, 0.01)] = 0.0
    mass_scale: Annotated[PerJoint, Range(1e-3, 1e3), Shown(
        "Believed mass scale", _BELIEVED, "", 0.2, 3.0, 0.05)] = 1.0
    inertia_scale: Annotated[PerJoint, Range(1e-3, 1e3), Shown(
        "Believed inertia scale", _BELIEVED, "", 0.2, 3.0, 0.05)] = 1.0
    gravity: Annotated[bool, Shown("Believed gravity", _BELIEVED)] = True
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self, "nominal.")

    def as_plant(self) -> PlantSettings:
        """Returns plant settings with the same values."""
        return PlantSettings(**vars(self))


class NominalModel:
    """M(q) and the bias torque C(q, q̇)q̇ + g(q) + D q̇ of (1) in the nominal model.

    Raises InputError for a per-joint list of the wrong length.
    """

    def __init__(self, robot: Robot, settings: NominalSettings) -> None:
        for name in ("armature", "mass_scale", "inertia_scale"):
            per_joint(f"nominal.{name}", getattr(settings, name), robot.n)
        self._damping = per_joint("nominal.damping", settings.damping, robot.n)
        self._model = true_model(robot, settings.as_plant())
        self._data = self._model.createData()

    def mass_matrix(self, q: Array) -> Array:
        """Returns M(q) with armature, (n, n) symmetric, kg·m²."""
        return mass_matrix(self._model, self._data, q)

    def bias(self, q: Array, v: Array) -> Array:
        """Returns the torque that keeps q̈ = 0, (n,) N·m."""
        return np.asarray(pin.nonLinearEffects(self._model, self._data, q, v) + self._damping * v)
