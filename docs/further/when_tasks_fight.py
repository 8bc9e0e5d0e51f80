"""When tasks fight: the projection into a null space causes a singularity."""

from __future__ import annotations

import math

import numpy as np

from docs.further.kit import LINK, Further, Line, Question, planar

M_BAR = 0.033


def _sigma(q_3: float) -> float:
    """Returns ‖J₂P₁‖ for joint 1's task below the hand's task, with an angle of q_3 degrees between links 2
    and 3."""
    J = planar(np.radians([-40.0, 100.0, q_3]))[1]
    return float(np.linalg.norm((np.eye(3) - np.linalg.pinv(J) @ J)[0]))


def _projected(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    J = planar(rng.normal(size=3))[1]
    return J @ (np.eye(3) - np.linalg.pinv(J) @ J), np.zeros((2, 3))


def _free_direction(rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    q = rng.normal(size=3)
    J = planar(q)[1]
    n = np.cross(J[0], J[1])
    return np.array([n[0], *(J @ n)]), np.array([LINK * LINK * math.sin(q[2]), 0.0, 0.0])


def _force(rng: np.random.Generator) -> tuple[float, float]:
    J, m, a = 1e-3 * rng.normal(size=(1, 3)), rng.uniform(0.01, 1.0), rng.normal()
    torque = J.T @ np.linalg.solve(J @ J.T / m, np.array([a]))
    return float(np.linalg.norm(torque)), m * abs(a) / float(np.linalg.norm(J))


def _capped(rng: np.random.Generator) -> tuple[float, float]:
    Q, R, e = rng.uniform(0.5, 5, 3)
    g = np.linspace(0, 20 * math.sqrt(R / Q), 400_001)
    return float((Q * g * e / (Q * g**2 + R)).max()), 0.5 * math.sqrt(Q / R) * e


FURTHER = Further(
    derivation=(
        Line(
            "Task 2 does not disturb task 1 if it is projected into the null space of $J_1$:",
            r"P_1 = I - J_1^+ J_1, \qquad J_1 P_1 = 0, \qquad J_{2|1} = J_2 P_1",
            _projected,
        ),
        Line(
            "On the planar arm one motion leaves the hand at rest. It is along the cross product $n$ of the "
            "two rows of $J_1$. The component $n_1$ of joint 1 vanishes where links 2 and 3 are in line:",
            r"n = J_{1,x} \times J_{1,y}, \qquad n_1 = l_2 l_3 \sin q_3, \qquad J_1 n = 0",
            _free_direction,
        ),
        Line(
            r"There the row $J_{2|1} = J_2 P_1$ has the length $\sigma = |n_1| / \lVert n \rVert \to 0$, "
            r"although $J_2 = (1, 0, 0)$ always has the length 1. With $\bar M = m I$, the torque that "
            "gives task 2 the acceleration $a$ is",
            r"\lVert J_{2|1}^\top (J_{2|1} \bar M^{-1} J_{2|1}^\top)^{-1} a \rVert = \frac{m\,|a|}{\sigma}",
            _force,
        ),
        Line(
            r"HIMPC does not divide by $\sigma$. Its level 2 minimises $Q (e + g \Delta\tau)^2 + R "
            r"\Delta\tau^2$ along $n$, with $g$ in proportion to $\sigma$, and its optimum is bounded for "
            r"every $g$:",
            r"\max_g |\Delta\tau^*| = \max_g \frac{Q g |e|}{Q g^2 + R} = \tfrac12 \sqrt{Q/R}\; |e|",
            _capped,
            1e-6,
        ),
    ),
    questions=(
        Question(
            r"Every joint has $\bar M = 0.033$ kg·m². Let $q_1 = -40°$ and $q_2 = 100°$. How much torque "
            "does the projection need to accelerate joint 1 by 1 rad/s² if $q_3$ is −90°, −10° or −1°?",
            r"$\sigma$ is ⟨s90⟩, ⟨s10⟩ and ⟨s1⟩. The torque $m/\sigma$ is ⟨t90⟩, ⟨t10⟩ and ⟨t1⟩ N·m. Where "
            "links 2 and 3 are nearly in line, the torque is inversely proportional to the angle, and every "
            "degree matters.",
            {
                **{f"s{k}": (_sigma(-float(k)), ".3f") for k in (90, 10, 1)},
                **{f"t{k}": (M_BAR / _sigma(-float(k)), ".2f") for k in (90, 10, 1)},
            },
        ),
        Question(
            r"Joint 1 is one radian behind its target, and its $K_P$ is 50 1/s². Below which $\sigma$ does "
            "the projection ask for more than the 4 N·m of the motor?",
            r"The task asks for $a = 50$ rad/s², so $\sigma = m a / 4 = ⟨sigma⟩$. With links 2 and 3 at a "
            r"right angle, $\sigma$ is ⟨s90⟩: even far from the singularity the margin is small, and the "
            "projection does not take the limit into account.",
            {"sigma": (M_BAR * 50 / 4, ".3f"), "s90": (_sigma(-90.0), ".3f")},
        ),
        Question(
            "The last line bounds a change of torque. Is this bound small with $Q = 200$, $R = 10$ and $e = "
            "50$ rad/s²? Which other part of HIMPC keeps the torque within its limits?",
            r"The bound is $\tfrac12\sqrt{Q/R}\,e = ⟨cap⟩$ N·m, far beyond any motor: a finite torque can "
            "still be too large for a motor. $R$ makes the problem well posed at the singularity (Lemma 1). "
            "The bounds (34f) keep the torque within its limits. A projection does not have such bounds.",
            {"cap": (0.5 * math.sqrt(200 / 10) * 50, ".0f")},
        ),
    ),
)
