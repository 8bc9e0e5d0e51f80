"""Your robot: the rule that suggests M̄ for a robot without measurements."""

from __future__ import annotations

from functools import cache

import numpy as np
from scipy.optimize import minimize

from docs.further.kit import Further, Line, Question, inertia, measured
from lessons.course import load_lesson
from robots import Robot
from robots.inertia import (
    LARGEST_EIGENVALUE,
    finite_range,
    mass_matrix,
    sample_configurations,
    suggest_M_bar,
)

TILT = measured("your-robot", "The head is tilted by more than 5°.")


@cache
def _lamp() -> tuple[Robot, np.ndarray, np.ndarray]:
    """Returns the lesson's robot, its initial configuration (5,), and the M̄ suggested for it (5,)."""
    lesson = load_lesson("your-robot")
    scene = lesson.run_of(lesson.steps[0]).prepared()
    robot = scene.robot
    return robot, np.asarray(scene.q_0), suggest_M_bar(robot.model, robot.q_lower, robot.q_upper)


def _largest(q: np.ndarray) -> float:
    """Returns λ_max(M⁻¹M̄) of the lamp at q (5,)."""
    robot, _, M_bar = _lamp()
    root = np.sqrt(M_bar)
    M = mass_matrix(robot.model, robot.model.createData(), q)
    return float(np.linalg.eigvalsh(root[:, None] * np.linalg.inv(M) * root)[-1])


@cache
def _worst() -> float:
    """Returns the largest λ_max(M⁻¹M̄) over all configurations: a local search from the four worst of 800
    random ones."""
    lower, upper = finite_range(_lamp()[0].q_lower, _lamp()[0].q_upper)
    tried = np.random.default_rng(1).uniform(lower, upper, (800, len(lower)))
    starts = sorted(tried, key=_largest)[-4:]
    bounds = list(zip(lower, upper, strict=True))

    def less(q: np.ndarray) -> float:
        return -_largest(np.clip(q, lower, upper))

    return max(-float(minimize(less, q, method="Powell", bounds=bounds).fun) for q in starts)


def _least_inertia(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the ratio of torque to acceleration of joint 1 while the other joints are free, and
    1/(M⁻¹)₁₁."""
    M = inertia(rng, 4)
    tau = np.array([1.0, 0, 0, 0])
    return 1.0 / float(np.linalg.solve(M, tau)[0]), 1.0 / float(np.linalg.inv(M)[0, 0])


def _similar(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    M, M_bar = inertia(rng, 4), np.diag(rng.uniform(0.1, 2, 4))
    root = np.sqrt(M_bar)
    plain = np.sort(np.linalg.eigvals(np.linalg.solve(M, M_bar)).real)
    return plain, np.sort(np.linalg.eigvalsh(root @ np.linalg.inv(M) @ root))


def _suggested(rng: np.random.Generator) -> tuple[float, float]:
    poses = sample_configurations(_lamp()[0].q_lower, _lamp()[0].q_upper, 200)
    return max(map(_largest, poses)), LARGEST_EIGENVALUE


def _between(rng: np.random.Generator) -> tuple[float, float]:
    return _worst(), 1.51


def _lighter(rng: np.random.Generator) -> tuple[float, float]:
    return _worst() / 0.75, 2.0


FURTHER = Further(
    derivation=(
        Line(
            r"The inertia that acts at joint $i$ is smallest if all other joints are free to move. Then a "
            r"torque $\tau_i$ alone gives $\ddot q_i = (M^{-1})_{ii} \tau_i$, that is, an inertia of",
            r"D_i = \frac{\tau_i}{\ddot q_i} = \frac{1}{(M^{-1})_{ii}}",
            _least_inertia,
        ),
        Line(
            r"The least $D_i$ over 200 poses give the diagonal of $\bar M$, up to a common factor that "
            r"follows from stability. The eigenvalues of $M^{-1} \bar M$ are those of a symmetric matrix, so "
            "they are real and positive:",
            r"\operatorname{eig}(M^{-1} \bar M) = \operatorname{eig}(\bar M^{1/2} M^{-1} \bar M^{1/2}) > 0",
            _similar,
        ),
        Line(
            "Errors vanish if the largest eigenvalue is below 2 (*No model needed*). In the worst of the "
            r"200 poses the suggested $\bar M$ gives",
            r"\max_{200\, q} \lambda_{\max}(M^{-1} \bar M) = 1.5",
            _suggested,
        ),
        Line(
            "Between these poses there are poses with a slightly larger eigenvalue. A search over all poses "
            "of the lesson's lamp finds",
            r"\max_q \lambda_{\max}(M^{-1} \bar M) \approx 1.51",
            _between,
            5e-3,
        ),
        Line(
            "The stability limit is 2, so that a real lamp, with its motors, may be 25 % lighter than the "
            "model before it reaches this limit in the worst pose:",
            r"\max_q \lambda_{\max}\left( (0.75\, M)^{-1} \bar M \right) \approx 2",
            _lighter,
            5e-3,
        ),
    ),
    questions=(
        Question(
            "In the worst pose the largest eigenvalue is 1.51, and the stability limit is 2. By which "
            r"factor may the suggested $\bar M$ be raised if the lamp must be stable in this pose? Why "
            "could the lesson raise it by 1.5?",
            "It may be raised by the factor $2/1.51 = ⟨factor⟩$. The lamp of the lesson moves little, and "
            r"$\lambda_{\max}$ in its initial pose is ⟨here⟩. 1.5 times this value is ⟨raised⟩, below 2. In "
            "the worst pose it would be ⟨there⟩.",
            {
                "factor": (2 / 1.51, ".2f"),
                "here": (_largest(_lamp()[1]), ".2f"),
                "raised": (1.5 * _largest(_lamp()[1]), ".2f"),
                "there": (1.5 * _worst(), ".2f"),
            },
        ),
        Question(
            "The real lamp is 1.5 times as heavy as its file says. What happens to the largest eigenvalue, "
            "1.5, and to the smallest? Is the heavier robot safer?",
            "All eigenvalues are divided by 1.5. The largest becomes ⟨largest⟩, in the middle between the "
            "stability limits 0 and 2. The small eigenvalues become smaller, so slow components are "
            "corrected even more slowly. The heavier robot is safer, but less accurate.",
            {"largest": (LARGEST_EIGENVALUE / 1.5, ".0f")},
        ),
        Question(
            "The lamp has five joints, and its head has six coordinates. How many degrees of freedom does "
            "the position leave to the orientation? Does the measured tilt agree with this number?",
            "It leaves two: $5 - 3$. Two degrees of freedom cannot reach all three coordinates of the "
            "orientation, so the head stays tilted by ⟨tilt⟩° while its position is reached. The posture "
            "task has no freedom left.",
            {"tilt": (TILT, ".1f")},
        ),
    ),
)
