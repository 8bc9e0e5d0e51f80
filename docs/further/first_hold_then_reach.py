"""First hold, then reach: the model of HTMPC, a lexicographic minimum, and where the base must stop."""

from __future__ import annotations

import math

import numpy as np
from scipy.linalg import expm

from docs.further.kit import Further, Line, Question, measured

STOPS = measured("first-hold-then-reach", "The base stops more than 1.5 m before its target.")
LEFT = measured("first-hold-then-reach", "The error of the hand is then")


def _integrated(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns the state after one knot by (4) and (5) with G = I: by the matrix exponential, and by the
    printed formula."""
    dt, q, v, u = 0.1, *rng.normal(size=3)
    A = np.array([[0, 1, 0], [0, 0, 1], [0, 0, 0.0]])  # acts on (q, v, u)
    return (expm(A * dt) @ np.array([q, v, u]))[:2], np.array([q + v * dt + 0.5 * u * dt**2, v + u * dt])


def _lexicographic(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Returns the minimiser of a weighted sum in which J₁ has the weight 1e8, and the minimiser of J₂ over
    the minimisers of J₁."""
    a, b = rng.normal(size=(1, 3)), rng.normal(size=(2, 3))
    r, s = rng.normal(size=1), rng.normal(size=2)
    rows = np.vstack([1e4 * a, b])
    heavy = np.linalg.lstsq(rows, np.concatenate([1e4 * r, s]), rcond=None)[0]
    first = np.linalg.pinv(a) @ r
    Z = np.linalg.svd(a)[2][1:].T
    strict = first + Z @ np.linalg.lstsq(b @ Z, s - b @ first, rcond=None)[0]
    return heavy, strict


def _held(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J_b, J_a, v = rng.normal(size=(3, 3)), rng.normal(size=(3, 6)), rng.normal(size=3)
    return J_b @ v + J_a @ (-np.linalg.pinv(J_a) @ J_b @ v), np.zeros(3)


def _nearest(rng: np.random.Generator) -> tuple[float, float]:
    """Returns the least distance from the goal to a grid of points around the hand, and the distance by the
    formula."""
    goal = np.array([3.5, 0.0])
    reach = rng.uniform(1.0, 2.0)
    r, angle = np.meshgrid(np.linspace(0, reach, 400), np.linspace(0, 2 * np.pi, 721))
    tried = np.hypot(r * np.cos(angle) - goal[0], r * np.sin(angle) - goal[1])
    return float(tried.min()), 3.5 - reach


FURTHER = Further(
    derivation=(
        Line(
            r"If the base rolls in every direction ($G = I$), the model (4), (5) is $\dot q = v$, $\dot v = "
            "u$. If $u$ is constant between the knots, (7b) is exact:",
            r"q_{k+1} = q_k + v_k \Delta t + \tfrac12 u_k \Delta t^2, \qquad v_{k+1} = v_k + u_k \Delta t",
            _integrated,
        ),
        Line(
            r"The lexicographic minimum (7a) is the plan with the smallest $\mathcal J_2$ among all plans "
            r"with the smallest $\mathcal J_1$. For linear errors it is the limit of the minimum of a "
            "weighted sum:",
            r"\operatorname{lex\,min}\,[\mathcal J_1, \mathcal J_2] = \lim_{w \to \infty} "
            r"\arg\min\, (w\, \mathcal J_1 + \mathcal J_2)",
            _lexicographic,
            1e-5,
        ),
        Line(
            r"The hand's velocity is $J_b v_b + J_a \dot q_a$. As long as $J_a$ has full rank, the arm can "
            r"compensate every motion of the base:",
            r"\dot q_a = -J_a^+ J_b v_b \quad\Rightarrow\quad J_b v_b + J_a \dot q_a = 0",
            _held,
        ),
        Line(
            "Where the arm is stretched, this is impossible. While the hand rests, the base stays within a "
            r"distance $\rho$ of the hand. If the goal of the base is at a distance $d > \rho$ from the "
            "hand, the least remaining distance to the goal is",
            r"\min_{\lVert p \rVert \le \rho} \lVert p - p_{goal} \rVert = d - \rho",
            _nearest,
            1e-6,
        ),
    ),
    questions=(
        Question(
            "In *Out of reach* the goal of the base is 3.5 m from the hand, and the arm reaches 1.86 m. How "
            "far before its goal should the base stop, and which distance does the lesson measure?",
            "In the plane the base should stop ⟨expected⟩ m before its goal. In the run the base stops "
            "⟨seen⟩ m before its goal. The geometry in space differs: the hand is not at the height of the "
            "shoulder, and the shoulder is not in the middle of the base.",
            {"expected": (3.5 - 1.86, ".2f"), "seen": (STOPS, ".2f")},
        ),
        Question(
            "In the last step the two tasks swap their levels. How far is the hand from its goal at the "
            "end, and why is this the distance of question 1?",
            "It is ⟨left⟩ m from its goal. The distance between the two goals and the length of the arm are "
            "the same as before. The error is now in the other task.",
            {"left": (LEFT, ".2f")},
        ),
        Question(
            "In *Nine joints, two tasks* the goal of the base is 0.5 m ahead and 0.4 m to the side. Why "
            "does the lesson state a distance of 64 cm? How many degrees of freedom are left over?",
            r"$\sqrt{0.5^2 + 0.4^2} = ⟨way⟩$ m. The robot has nine joints. The hand's task has three "
            "coordinates and the base's task has two, which leaves ⟨free⟩ degrees of freedom: the base may "
            "turn, and the arm may move its elbow and turn the hand.",
            {"way": (math.hypot(0.5, 0.4), ".2f"), "free": (9.0 - 5, ".0f")},
        ),
    ),
)
