"""Told wrong: the effect of a wrong report on a distance, and of a late correction on braking."""

from __future__ import annotations

import numpy as np

from docs.further.kit import Further, Line, Question, measured
from himpc.qp import solve_qp
from lessons.settings.missions import PerceptionOptions

DEPTH = -0.1 * measured("told-wrong", "The robot overlaps the crate by at least 30 cm.")
IN_TIME = 0.1 * measured("told-wrong", "The robot overlaps the crate by at least 30 cm.", there=True)
OFFSET = 100.0 * float(np.linalg.norm(PerceptionOptions().report_offset))
SPEED, DECELERATION, PERIOD = 0.4, 1.0, 0.1


def to_box(p: np.ndarray, centre: np.ndarray, half: np.ndarray) -> float:
    """Returns the distance of a point from a box. The point is outside the box."""
    return float(np.linalg.norm(np.maximum(np.abs(p - centre) - half, 0.0)))


def _outside(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Returns a point outside a box, the box's centre and half its edges."""
    half = rng.uniform(0.1, 0.5, 3)
    centre = rng.normal(size=3)
    return centre + rng.choice((-1.0, 1.0), 3) * (half + rng.uniform(0.5, 2.0, 3)), centre, half


def _box(rng: np.random.Generator) -> tuple[float, float]:
    p, centre, half = _outside(rng)
    nearest = solve_qp(np.eye(3), -p, np.eye(3), centre - half, centre + half).x
    return float(np.linalg.norm(p - nearest)), to_box(p, centre, half)


def _shifted(rng: np.random.Generator) -> tuple[float, float]:
    p, centre, half = _outside(rng)
    off = rng.normal(scale=0.1, size=3)
    return to_box(p, centre + off, half), to_box(p - off, centre, half)


def _worst(rng: np.random.Generator) -> tuple[float, float]:
    p, centre, half = _outside(rng)
    size = rng.uniform(0.05, 0.2)
    nearest = np.clip(p, centre - half, centre + half)
    away = size * (nearest - p) / np.linalg.norm(nearest - p)
    return to_box(p, centre, half), to_box(p, centre + away, half) - size


def _braking(rng: np.random.Generator) -> tuple[float, float]:
    v, t, a = rng.uniform(0.1, 1.0), rng.uniform(0.05, 0.5), rng.uniform(0.5, 2.0)
    clock = np.linspace(0.0, t + v / a, 200_001)
    speed = np.clip(v - a * (clock - t), 0.0, v)
    return float(np.trapezoid(speed, clock)), v * t + v**2 / (2.0 * a)


FURTHER = Further(
    derivation=(
        Line(
            "A point $p$ of the robot is outside a box with centre $c$ and half edges $h$. Absolute value "
            "and maximum are taken for each coordinate. The distance of the point from the box is",
            r"\mathrm{sd}(p; c) = \lVert \max(|p - c| - h, 0) \rVert",
            _box,
        ),
        Line(
            r"An error $\Delta$ of the reported box has the same effect as an error $-\Delta$ of the "
            "robot's position:",
            r"\mathrm{sd}(p; c + \Delta) = \mathrm{sd}(p - \Delta; c)",
            _shifted,
        ),
        Line(
            "The distance changes by no more than the shift. In the worst case the report moves the box "
            "straight away from the robot, and the true distance is smaller by the whole shift:",
            r"\mathrm{sd}(p; c) = \mathrm{sd}(p; c + \Delta) - \lVert \Delta \rVert",
            _worst,
        ),
        Line(
            "When the report is corrected, the robot reacts at the next plan, a time $t$ later, and brakes "
            "with the deceleration $a$. From the speed $v$ it needs the distance",
            r"s = v t + \frac{v^2}{2 a}",
            _braking,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "Reports are wrong by at most 20 cm, in any direction. Which $d_{\\mathrm{safe}}$ keeps a "
            "distance of 5 cm?",
            r"By the third line $d_{\mathrm{safe}}$ must be $5 + 20$ = ⟨margin⟩ cm. A margin can cover a "
            "bounded error of the report.",
            {"margin": (5.0 + 20.0, ".0f")},
        ),
        Question(
            r"Which $d_{\mathrm{safe}}$ would have covered the error of the report in the lesson? What is "
            "the disadvantage of this margin?",
            "It is $5 + ⟨offset⟩$ = ⟨margin⟩ cm. With this margin the base would also have to leave its "
            "line for a crate that is beside the line and correctly reported. In the lesson the robot "
            "overlapped the crate by ⟨depth⟩ cm. With a correct report from 5 s on, it kept a distance of "
            "⟨kept⟩ cm.",
            {
                "offset": (OFFSET, ".0f"),
                "margin": (5.0 + OFFSET, ".0f"),
                "depth": (DEPTH, ".0f"),
                "kept": (IN_TIME, ".0f"),
            },
        ),
        Question(
            "A base drives at 0.4 m/s towards the crate, plans ten times a second and brakes with 1 m/s². "
            "How far from the crate must the base still be when the report is corrected, if the base must "
            "keep 5 cm?",
            "The base needs ⟨room⟩ cm to stop and must keep 5 cm. It must still be at least ⟨far⟩ cm from "
            "the crate.",
            {
                "room": (100.0 * (SPEED * PERIOD + SPEED**2 / (2.0 * DECELERATION)), ".0f"),
                "far": (100.0 * (SPEED * PERIOD + SPEED**2 / (2.0 * DECELERATION)) + 5.0, ".0f"),
            },
        ),
    ),
)
