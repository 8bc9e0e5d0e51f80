"""Your robot: how M̄ is suggested for a file nobody has measured."""

from __future__ import annotations

from functools import cache

import numpy as np

from docs.further.kit import Further, Line, Question, inertia, measured
from robots import Robot, load_robot
from robots.inertia import LARGEST_EIGENVALUE, mass_matrix, sample_configurations, suggest_M_bar

TILT = measured("your-robot", "It is tilted by more than 5°.")


@cache
def _arm() -> tuple[Robot, np.ndarray]:
    """The planar arm and its M at the configurations that a suggestion looks at, (k, 3, 3)."""
    robot = load_robot("planar3")
    data = robot.model.createData()
    poses = sample_configurations(robot.q_lower, robot.q_upper, 200)
    return robot, np.array([mass_matrix(robot.model, data, q) for q in poses])


def _largest(M: np.ndarray, M_bar: np.ndarray) -> float:
    return max(float(np.linalg.eigvals(np.linalg.solve(each, np.diag(M_bar))).real.max()) for each in M)


def _least_inertia(rng: np.random.Generator) -> tuple[float, float]:
    """Torque over acceleration of joint 1, the other joints free."""
    M = inertia(rng, 4)
    tau = np.array([1.0, 0, 0, 0])
    return 1.0 / float(np.linalg.solve(M, tau)[0]), 1.0 / float(np.linalg.inv(M)[0, 0])


def _similar(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar = inertia(rng, 4), np.diag(rng.uniform(0.1, 2, 4))
    root = np.sqrt(M_bar)
    plain = np.sort(np.linalg.eigvals(np.linalg.solve(M, M_bar)).real)
    return plain, np.sort(np.linalg.eigvalsh(root @ np.linalg.inv(M) @ root))


def _suggested(rng: np.random.Generator) -> tuple[float, float]:
    robot, M = _arm()
    M_bar = suggest_M_bar(robot.model, robot.q_lower, robot.q_upper)
    return _largest(M, M_bar), LARGEST_EIGENVALUE


def _lighter(rng: np.random.Generator) -> tuple[float, float]:
    robot, M = _arm()
    M_bar = suggest_M_bar(robot.model, robot.q_lower, robot.q_upper)
    return _largest(0.75 * M, M_bar), 2.0


FURTHER = Further(
    derivation=(
        Line(
            r"How heavy is joint $i$? Never lighter than with all other joints free to give way. Then a "
            r"torque $\tau_i$ alone gives $\ddot q_i = (M^{-1})_{ii} \tau_i$, an inertia of",
            r"D_i = \frac{\tau_i}{\ddot q_i} = \frac{1}{(M^{-1})_{ii}}",
            _least_inertia,
        ),
        Line(
            r"The least $D_i$ over 200 poses gives $\bar M$ its shape. Its size is a matter of stability. "
            r"The eigenvalues of $M^{-1} \bar M$ are those of a symmetric matrix, so they are real and "
            r"positive:",
            r"\operatorname{eig}(M^{-1} \bar M) = \operatorname{eig}(\bar M^{1/2} M^{-1} \bar M^{1/2}) > 0",
            _similar,
        ),
        Line(
            r"and errors die out if the largest is below 2 (*No model needed*). The suggestion has, in "
            r"the worst pose,",
            r"\max_q \lambda_{\max}(M^{-1} \bar M) = 1.5",
            _suggested,
        ),
        Line(
            "so that a real robot may be a quarter lighter than its file says before the edge is reached:",
            r"\max_q \lambda_{\max}\left( (\tfrac34 M)^{-1} \bar M \right) = 2",
            _lighter,
        ),
    ),
    questions=(
        Question(
            r"By which factor may the suggested $\bar M$ be raised if the robot must be safe in its worst "
            r"pose (1.5 in place of 2)? "
            "Why could the lesson double it?",
            r"By $2/1.5 = ⟨factor⟩$. The lamp of the lesson moves little, and where it does "
            r"$\lambda_{\max}$ is smaller than in its "
            "worst pose: the gauge stays below 1. Elsewhere twice the suggestion may be too much.",
            {"factor": (2 / LARGEST_EIGENVALUE, ".2f")},
        ),
        Question(
            "The real lamp is half as heavy again as its file (1.5 times). What happens to the largest "
            "eigenvalue of 1.5, and to the smallest? Is the heavier robot safer?",
            r"All are divided by 1.5: the largest becomes ⟨largest⟩, as far from the edge as can be. The "
            r"small ones become smaller, "
            "so slow components are corrected more slowly still. Safer, and less accurate.",
            {"largest": (LARGEST_EIGENVALUE / 1.5, ".0f")},
        ),
        Question(
            "Five joints, six coordinates of the head. How many freedoms has the orientation after the "
            "position, and how does the measured tilt fit that?",
            "Two: $5 - 3$. Three coordinates of orientation cannot all be had with two freedoms, so the "
            "head stays tilted by ⟨tilt⟩° while its position is reached. Posture finds none left.",
            {"tilt": (TILT, ".1f")},
        ),
    ),
)
