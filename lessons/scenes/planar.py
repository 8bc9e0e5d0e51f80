"""RT1, RT2 and RT3: the planar arm of section V; and the same arm with a QP that can be drawn in a plane."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Annotated

import numpy as np

from himpc.limits import Limits
from himpc.references import Circle, Hold, Phase, Preview, Reference, Sinusoid
from himpc.references.preview import sampled, times
from himpc.stack import Level, Stack
from himpc.tasks import FramePosition, Joints
from lessons.scenes.hold import PLANAR3_PLANT
from lessons.scenes.scene import TorqueScene
from lessons.settings.torque import SceneOptions, TorqueSettings
from robots import NominalSettings, PlantSettings, Robot, load_robot
from robots.ranges import Range, Shown, check_fields

OMEGA = 2 * math.pi / 8
"""Angular frequency, rad/s; every circle takes 8 s."""

_ARMATURE = (0.05, 0.05, 0.03)

PLANT = PlantSettings(armature=_ARMATURE, damping=(0.15, 0.1, 0.08), friction=(0.1, 0.08, 0.05))
"""Armature and joint friction are our choice: the paper does not print the arm's mechanics."""

NOMINAL = NominalSettings(
    mass_scale=0.8, inertia_scale=0.8, armature=tuple(0.8 * value for value in _ARMATURE)
)
"""The nominal model: masses and inertias are 20 % too small, friction is unknown."""

CONFLICT_LIMITS = Limits(velocity_approach=8.0)
"""In a conflict the arm swings about the algorithmic singularity from one velocity bound to the other. The
error of level 1 is smaller if the arm approaches the bounds more slowly than by default: `himpc-lab reproduce
himpc-table-3` measures this error with 0, 8 and 15 1/s."""


@dataclass(frozen=True)
class CircleOptions(SceneOptions):
    """RT1 and RT2: the EE follows a circle, and q₁ swings once meanwhile."""

    # fmt: off
    q1_amplitude_deg: Annotated[float, Range(-360.0, 360.0), Shown(
        "Swing of q₁", "Angle by which joint 1 swings before it returns", "°", -180.0, 180.0, 5.0)]
    # fmt: on

    def __post_init__(self) -> None:
        check_fields(self)

    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """Returns a circle of r = 0.1 m about (0.5, 0.3) with phase ωt − sin ωt, and q₁ = amplitude·(1 − cos
        ωt)/2."""
        half = np.array([0.5 * math.radians(self.q1_amplitude_deg)])
        return {
            "position": _circle(0.5, 0.3, 0.1, Phase(OMEGA, "eased")),
            "q1": Sinusoid(half, half, Phase(OMEGA, offset=-0.5 * math.pi)),
        }


@dataclass(frozen=True)
class SingularOptions(SceneOptions):
    """RT3: two circles through the point that only the straight arm reaches."""

    # fmt: off
    smooth: Annotated[bool, Shown(
        "Smooth", "Use the phase ωt − sin ωt, which is at rest in the singular point, instead of ωt")] = False
    # fmt: on

    def references(self, robot: Robot, stack: Stack) -> Mapping[str, Reference]:
        """Returns circles of r = 0.1 and 0.2 m, internally tangent at (0.9, 0), 8 s each, and q₁ = 0."""
        phase = Phase(OMEGA, "eased" if self.smooth else "uniform")
        return {
            "position": Switched(_circle(0.8, 0.0, 0.1, phase), _circle(0.7, 0.0, 0.2, phase), 8.0),
            "q1": Hold(np.zeros(1)),
        }


@dataclass(frozen=True, eq=False)
class Switched:
    """One reference before a time (s) and another one afterwards, without a smooth transition."""

    before: Reference
    after: Reference
    at: float

    def preview(self, t: float, T_s: float, N: int) -> Preview:
        first, second = self.before.preview(t, T_s, N), self.after.preview(t, T_s, N)
        late = (times(t, T_s, N) >= self.at - 1e-9)[:, None]
        return sampled(
            np.where(late, second.value + second.displacement, first.value + first.displacement),
            np.where(late, second.velocity, first.velocity),
            np.where(late, second.acceleration, first.acceleration),
        )


def planar3_circle() -> TorqueScene:
    """`planar3-circle`, RT1: q₁ swings by 20°, which the circle allows.

    From the paper: link lengths, limits, gains (Table I), Q = 200, R = 10, N = 5, M̄, q₀. Not given in the
    paper and chosen here: masses and inertias (see the URDF), armature and friction (`plant.…`), the nominal
    model of OSF and HQP (`nominal.…`), centre, radius and time law of the circle, and the swing of q₁
    (`q1_amplitude_deg`): Fig. 3 has no readable scale.
    """
    robot = load_robot("planar3")
    levels = (
        Level((FramePosition(name="position", axes="xy", K_p=200.0, K_v=10.0),)),
        Level((Joints(name="q1", joints=robot.joint_names[:1], K_p=50.0, K_v=5.0),)),
    )
    options = CircleOptions(q1_amplitude_deg=20.0)
    return TorqueScene(
        name="planar3-circle",
        title="planar arm on RT1 of the HIMPC paper",
        robot=robot,
        settings=TorqueSettings(
            stack=levels, M_bar=tuple(robot.M_bar), nominal=NOMINAL, plant=PLANT, options=options
        ),
        references=options.references,
        q_0=np.radians([0.0, 90.0, -90.0]),
        v_0=np.zeros(3),
        duration=8.0,
    )


def planar3_conflict() -> TorqueScene:
    """`planar3-conflict`, RT2: the reference of q₁ swings by −120°, where the circle is out of reach.

    Otherwise as `planar3-circle`, but the arm approaches velocity bounds more slowly. The paper prints no
    amplitude; −60° and 170° also conflict with the circle (`q1_amplitude_deg`). The plant applies any torque,
    so that the demand of a controller acts unchanged (`plant.saturate`).
    """
    scene = planar3_circle()
    settings = replace(
        scene.settings,
        limits=CONFLICT_LIMITS,
        plant=replace(PLANT, saturate=False),
        options=CircleOptions(q1_amplitude_deg=-120.0),
    )
    title = "planar arm on RT2: its two tasks conflict"
    return replace(scene, name="planar3-conflict", title=title, settings=settings)


def planar3_singular() -> TorqueScene:
    """`planar3-singular`, RT3: the arm starts straight, and is straight again after 8 s and 16 s.

    Otherwise as `planar3-circle`. Fig. 9 shows two tangent circles, but not their sizes, time law or q₁.
    Chosen here: radii 0.1 and 0.2 m, phase ωt, and q₁ = 0, which both circles allow. The velocity jumps at
    0 s and 8 s (section V-C mentions the jump at 8 s); `smooth=true` removes the jumps.
    """
    scene = planar3_circle()
    return replace(
        scene,
        name="planar3-singular",
        title="planar arm on RT3: straight and singular three times",
        settings=replace(scene.settings, options=SingularOptions()),
        q_0=np.zeros(3),
        duration=16.0,
    )


def _circle(x: float, y: float, radius: float, phase: Phase) -> Circle:
    return Circle(np.array([x, y]), np.array([radius, 0.0]), np.array([0.0, radius]), phase)


def planar3_plane() -> TorqueScene:
    """`planar3-plane`: the planar arm with N = 1. Its wrist is dragged along x, and two joints have fixed
    targets.

    Level 1 is the wrist's x (one coordinate), level 2 the angles of joints 1 and 2, level 3 holds joint 3.
    The wrist is where joint 3 sits, and M̄ is diagonal: neither of the first two levels uses joint 3, so the
    results of these levels lie in the plane of Δτ₁ and Δτ₂. The first two levels cannot both be met, and
    their conflict is always visible.
    """
    robot = load_robot("planar3", tip="link_3")
    first, second, third = robot.joint_names
    levels = (
        Level((FramePosition(name="reach", axes="x", K_p=100.0, K_v=20.0),)),
        Level((Joints(name="pose", joints=(first, second), K_p=50.0, K_v=15.0),), Q=(200.0, 50.0)),
        Level((Joints(name="wrist", joints=(third,), K_p=50.0, K_v=15.0),)),
    )
    return TorqueScene(
        name="planar3-plane",
        title="planar arm, one knot: level 1 pulls the wrist along x, level 2 keeps two joints",
        robot=robot,
        settings=TorqueSettings(stack=levels, M_bar=tuple(robot.M_bar), horizon=1, plant=PLANAR3_PLANT),
        references=lambda robot, stack: {},
        q_0=np.radians([20.0, 80.0, -60.0]),
        v_0=np.zeros(3),
        duration=3.0,
    )
